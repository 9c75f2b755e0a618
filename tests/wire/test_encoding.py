"""Encoded messages, compared with bytes made by hand and by the rosbags library, and decoded again."""

import dataclasses
import math
import struct

import pytest

from kbot.messages import control
from kbot.messages import types as msg
from kbot.record.encodings.serialization import decode_cdr, decode_ros1, encode_cdr, encode_ros1
from kbot.record.encodings.type_names import NAMESAKES, ros_name, shipped_types
from kbot.record.encodings.types import known_type, ros1_definition, ros1_types, ros2_types
from kbot.text import KbotError

OWN = [value for value in vars(msg).values() if isinstance(value, type) and value.__module__ == msg.__name__]
STAMP = msg.Header(msg.Time(3, 25), "odom")
FULL = [
    msg.ClockMessage(msg.Time(12, 999_999_999)),
    msg.String("wörld"),
    msg.Twist(msg.Vector3(0.1, -2.0, math.inf), msg.Vector3(1e-300, 0.0, -0.0)),
    msg.TwistStamped(STAMP, msg.Twist(msg.Vector3(0.3))),
    msg.Odometry(
        STAMP,
        "base",
        msg.PoseWithCovariance(msg.Pose(msg.Point(1, 2, 3)), tuple(float(n) for n in range(36))),
        msg.TwistWithCovariance(msg.Twist(msg.Vector3(0.5)), tuple(-float(n) for n in range(36))),
    ),
    control.Float64(-2.5),
    control.Float64MultiArray(data=(1.0, 2.0)),
    control.JointTrajectory(
        STAMP,
        ("a", "bc"),
        (control.JointTrajectoryPoint((1.0, 2.0), (0.5, 0.25), time_from_start=control.Duration(1, 5)),),
    ),
    msg.JointState(STAMP, ("a", "bc"), (1.0, 2.0), (3.0, 4.0), ()),
    msg.JointState(),
    msg.TFMessage((msg.TransformStamped(STAMP, "x"), msg.TransformStamped(STAMP, "longer"))),
    msg.TFMessage(),
]


@pytest.mark.parametrize("kind", OWN, ids=lambda kind: kind.__name__)
def test_every_message_has_the_fields_of_its_ros_type(kind: type) -> None:
    name = ros_name(kind)
    fields = [field.name for field in dataclasses.fields(kind)]
    assert known_type(name) is kind
    assert [field for field, _ in ros2_types().fielddefs[name][1]] == fields
    assert [field for field, _ in ros1_types().fielddefs[name][1] if field != "seq"] == fields


def test_ros_name_has_the_package_of_the_type() -> None:
    type_names = [f"{package}/msg/{name}" for package, names in NAMESAKES.items() for name in names.split()]
    assert len(type_names) > 50
    assert set(type_names) <= set(shipped_types().fielddefs)


@pytest.mark.parametrize("kind", OWN, ids=lambda kind: kind.__name__)
def test_default_message_survives_a_round_trip(kind: type) -> None:
    assert decode_cdr(encode_cdr(kind()), kind) == kind()
    assert decode_ros1(encode_ros1(kind()), kind) == kind()


@pytest.mark.parametrize("message", FULL, ids=lambda m: type(m).__name__)
def test_full_message_survives_a_round_trip_in_both_encodings(message: object) -> None:
    kind, name = type(message), ros_name(type(message))
    cdr, ros1 = encode_cdr(message), encode_ros1(message)
    assert decode_cdr(cdr, kind) == message
    assert decode_ros1(ros1, kind) == message
    assert bytes(ros2_types().ros1_to_cdr(ros1, name)) == cdr


def test_bytes_match_a_calculation_by_hand() -> None:
    """ROS 1: seq, secs, nsecs, then each string and list with its length. CDR: aligned relative to byte 4."""
    header = struct.pack("<IiI", 0, 3, 25) + struct.pack("<I4s", 4, b"odom")
    lists = struct.pack("<II1s", 1, 1, b"a") + struct.pack("<Id", 1, 0.5) + struct.pack("<II", 0, 0)
    assert encode_ros1(msg.JointState(STAMP, ("a",), (0.5,))) == header + lists
    assert encode_cdr(msg.ClockMessage(msg.Time(1, 2))) == b"\0\1\0\0" + struct.pack("<iI", 1, 2)
    assert encode_cdr(msg.String("hi")) == b"\0\1\0\0" + struct.pack("<I", 3) + b"hi\0"


def test_definitions_match_ros() -> None:
    """MD5 sums as `rosmsg md5` prints them."""
    sums = {
        "nav_msgs/msg/Odometry": "cd5e73d190d741a2f92e81eda573aca7",
        "geometry_msgs/msg/Twist": "9f195f881246fdfa2798d1d3eebca84a",
        "tf2_msgs/msg/TFMessage": "94810edda583a504dfda3829e70d7eec",
        "sensor_msgs/msg/JointState": "3066dcd76a6cfaef579bd0f34173e9fd",
        "rosgraph_msgs/msg/Clock": "a9c97c1d230cfc112e270351a944ee47",
        "map_msgs/msg/OccupancyGridUpdate": "b295be292b335c34718bd939deebe1c9",
        "std_msgs/msg/String": "992ce8a1687cec8c8bd883ec73ca41d1",
        "move_base_msgs/msg/MoveBaseActionGoal": "660d6895a1b9a16dce51fbdd9a64a56b",
        "move_base_msgs/msg/MoveBaseActionResult": "1eb06eeff08fa7ea874431638cb52332",
        "move_base_msgs/msg/MoveBaseActionFeedback": "7d1870ff6e0decea702b943b5af0b42e",
    }
    assert {name: ros1_definition(name)[1] for name in sums} == sums


@pytest.mark.parametrize("data", [b"", b"\0", b"\xff" * 60, b"\xff\xff\xff\x7f" * 4])
def test_bytes_that_are_not_a_message_are_one_error(data: bytes) -> None:
    for decode in (decode_cdr, decode_ros1):
        for kind in (msg.JointState, msg.Odometry, msg.TFMessage):
            with pytest.raises(KbotError, match=r"are not a \w+/msg/\w+"):
                decode(data, kind)


def test_message_unknown_to_ros_is_reported() -> None:
    with pytest.raises(KbotError, match="Unheard is not a ROS message"):
        encode_cdr(type("Unheard", (), {})())
