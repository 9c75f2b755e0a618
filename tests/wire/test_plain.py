"""Messages as plain values for JSON."""

import json
import math

import numpy as np
import pytest

from kbot.messages import navigation, sensing
from kbot.messages import types as msg
from kbot.record.encodings.plain import from_plain, to_json, to_plain
from kbot.text import KbotError


def test_plain_values_survive_a_round_trip() -> None:
    message = msg.JointState(msg.Header(msg.Time(3, 25), "f"), ("a", "b"), (1.0, 2.5), (), (0.5,))
    plain = json.loads(json.dumps(to_plain(message)))
    assert plain["header"] == {"stamp": {"sec": 3, "nanosec": 25}, "frame_id": "f"}
    assert plain["position"] == [1.0, 2.5]
    assert from_plain(plain, msg.JointState) == message


def test_ros_1_field_names_of_times_are_written_and_read() -> None:
    plain = to_plain(msg.Header(msg.Time(3, 25)), ros1=True)
    assert plain["stamp"] == {"secs": 3, "nsecs": 25}
    assert from_plain({"seq": 7, **plain}, msg.Header) == msg.Header(msg.Time(3, 25))


def test_missing_fields_keep_defaults_and_integers_are_accepted() -> None:
    assert from_plain({"linear": {"x": 1}}, msg.Twist) == msg.Twist(msg.Vector3(1.0))


def test_nan_is_null_in_json() -> None:
    assert to_plain(msg.Vector3(math.inf, math.nan)) == {"x": None, "y": None, "z": 0.0}
    assert math.isnan(from_plain({"x": None}, msg.Vector3).x)


def test_json_matches_the_plain_values() -> None:
    """NaN and infinity are null, or NaN and Infinity if exact values are requested. Lone surrogates, which
    are not valid Unicode, are escaped."""
    scan = sensing.LaserScan(range_max=math.inf, ranges=np.array([0.1, math.nan, -math.inf], np.float32))
    for message in (scan, msg.String("null \ud800"), msg.Odometry(), sensing.Image(data=b"abc")):
        for ros1 in (False, True):
            assert json.loads(to_json(message, ros1=ros1)) == to_plain(message, ros1=ros1)
            exact = json.loads(to_json(message, ros1=ros1, exact=True))
            assert repr(exact) == repr(json.loads(json.dumps(to_plain(message, ros1=ros1, exact=True))))
    assert '"range_max": Infinity' in to_json(scan, exact=True)


@pytest.mark.parametrize(
    ("value", "message"),
    [
        ({"lineer": {}}, "has no field 'lineer': did you mean 'linear'"),
        ({"linear": {"x": "1"}}, "a number is expected, not str '1'"),
        ({"linear": {"x": True}}, "a number is expected, not bool"),
        ({"linear": [1, 2, 3]}, "needs fields by name, not list"),
        ({"linear": None}, "not nothing"),
        (5, "not int '5'"),
        ({"linear": {"x": 10**400}}, "too large"),
    ],
)
def test_invalid_message_is_reported(value: object, message: str) -> None:
    with pytest.raises(KbotError, match=r"^not a geometry_msgs/msg/Twist: ") as caught:
        from_plain(value, msg.Twist)
    assert message in str(caught.value)


def test_arrays_are_lists_and_bytes_are_base64() -> None:
    scan = sensing.LaserScan(ranges=np.array([1.5, np.inf], np.float32))
    plain = json.loads(json.dumps(to_plain(scan)))
    assert plain["ranges"] == [1.5, None]
    back = from_plain(plain, sensing.LaserScan)
    assert back.ranges.dtype == np.float32
    np.testing.assert_array_equal(back.ranges, [1.5, np.nan])
    grid = from_plain({"data": [-1, 100]}, navigation.OccupancyGrid)
    np.testing.assert_array_equal(grid.data, np.array([-1, 100], np.int8))
    image = to_plain(sensing.Image(data=b"abc"))
    assert image["data"] == "YWJj"
    assert from_plain(image, sensing.Image).data == b"abc"
