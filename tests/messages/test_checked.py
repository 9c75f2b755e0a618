"""The check of a message before it is published: values of numpy, types, ranges, lengths and shapes."""

import math
import sys
from collections.abc import Callable
from dataclasses import dataclass
from dataclasses import fields as dataclass_fields
from typing import Any

import numpy as np
import pytest
from rosbags.interfaces import Nodetype

from kbot.messages import (
    Bus,
    Header,
    JointState,
    Odometry,
    PoseWithCovariance,
    String,
    TFMessage,
    TransformStamped,
    Twist,
    Vector3,
)
from kbot.messages.checked import checked
from kbot.messages.control import Float64
from kbot.messages.navigation import OccupancyGrid
from kbot.messages.sensing import Bool, CameraInfo, Image, Imu, Joy, LaserScan, NavSatStatus, PointCloud2
from kbot.messages.types import Time
from kbot.messages.visualization import ColorRGBA, Marker
from kbot.record.encodings.definitions import fields
from kbot.record.encodings.plain import from_plain, to_json, to_plain
from kbot.record.encodings.serialization import decode_cdr, decode_ros1, encode_cdr, encode_ros1
from kbot.record.encodings.type_names import NAMESAKES, ros_name, shipped_types
from kbot.record.encodings.types import known_type
from kbot.text import KbotError

ROWS = np.arange(12, dtype=np.uint8).reshape(2, 2, 3)


def published(message: Any) -> Any:
    """The message that a subscriber of the bus receives."""
    bus, received = Bus(), list[Any]()
    bus.subscribe("topic", type(message), received.append)
    bus.publish("topic", message)
    (found,) = received
    return found


@dataclass(frozen=True)
class Case:
    """A field's value as a user may write it, and the same in Python's own types."""

    make: Callable[[Any], Any]
    read: Callable[[Any], Any]
    given: object
    plain: object


def _covariance(value: Any) -> Odometry:
    return Odometry(pose=PoseWithCovariance(covariance=value))


SPEED: tuple[Callable[[Any], Any], Callable[[Any], Any]] = (
    lambda value: Twist(Vector3(value)),
    lambda message: message.linear.x,
)
HEIGHT = (lambda value: Image(height=value)), (lambda message: message.height)
PIXELS = (lambda value: Image(data=value)), (lambda message: message.data)
RANGES = (lambda value: LaserScan(ranges=value)), (lambda message: message.ranges)
CELLS = (lambda value: OccupancyGrid(data=value)), (lambda message: message.data)
POSITIONS = (lambda value: JointState(position=value)), (lambda message: message.position)
BUTTONS = (lambda value: Joy(buttons=value)), (lambda message: message.buttons)
COVARIANCE = _covariance, (lambda message: message.pose.covariance)
FLAG = Bool, (lambda message: message.data)
TEXT = String, (lambda message: message.data)

CASES = {
    "float32": Case(*SPEED, np.float32(0.25), 0.25),
    "float64": Case(*SPEED, np.float64(0.3), 0.3),
    "float16": Case(*SPEED, np.float16(0.5), 0.5),
    "integer scalar in a float field": Case(*SPEED, np.int16(2), 2.0),
    "array without dimensions": Case(*SPEED, np.array(0.75), 0.75),
    "int in a float field": Case(*SPEED, 1, 1.0),
    "uint8 scalar": Case(*HEIGHT, np.uint8(7), 7),
    "int64 scalar": Case(*HEIGHT, np.int64(480), 480),
    "bool scalar": Case(*FLAG, np.bool_(True), True),
    "string scalar": Case(*TEXT, np.str_("left"), "left"),
    "float64 array": Case(*RANGES, np.array([0.5, math.inf]), np.array([0.5, math.inf], np.float32)),
    "integer array in a float field": Case(*RANGES, np.array([1, 2]), np.array([1, 2], np.float32)),
    "list of ranges": Case(*RANGES, [0.5, 2], np.array([0.5, 2.0], np.float32)),
    "empty list of ranges": Case(*RANGES, [], np.array([], np.float32)),
    "array of the other byte order": Case(
        *RANGES, np.array([0.5], ">f4"), np.array([0.5], np.float32)
    ),
    "int64 array of cells": Case(*CELLS, np.array([-1, 100]), np.array([-1, 100], np.int8)),
    "image": Case(*PIXELS, ROWS, bytes(range(12))),
    "image in another order": Case(*PIXELS, ROWS[0, :, ::-1], bytes([2, 1, 0, 5, 4, 3])),
    "bytearray": Case(*PIXELS, bytearray(b"ab"), b"ab"),
    "list of bytes": Case(*PIXELS, [97, np.uint8(98)], b"ab"),
    "float32 array in a tuple": Case(*POSITIONS, np.array([0.5, 1.5], np.float32), (0.5, 1.5)),
    "integer array in a tuple": Case(*POSITIONS, np.arange(3), (0.0, 1.0, 2.0)),
    "list with scalars": Case(*POSITIONS, [np.float32(0.5), 2], (0.5, 2.0)),
    "integer array of buttons": Case(*BUTTONS, np.array([1, 0], np.uint8), (1, 0)),
    "array of 36": Case(*COVARIANCE, np.zeros(36), (0.0,) * 36),
}  # fmt: skip
"""Values of numpy in each kind of field."""


def same(found: object, plain: object) -> bool:
    if isinstance(plain, np.ndarray):
        return isinstance(found, np.ndarray) and found.dtype == plain.dtype and np.array_equal(found, plain)
    items = zip(found, plain, strict=True) if isinstance(plain, tuple) else [(found, plain)]
    return found == plain and all(type(a) is type(b) for a, b in items)


@pytest.mark.parametrize("name", CASES)
def test_the_bus_delivers_plain_values(name: str) -> None:
    case = CASES[name]
    found = case.read(published(case.make(case.given)))
    assert same(found, case.plain), found


WAYS: dict[str, Callable[[Any], Any]] = {
    "ROS 2 and recordings": lambda message: decode_cdr(encode_cdr(message), type(message)),
    "ROS 1": lambda message: decode_ros1(encode_ros1(message), type(message)),
    "local, rosbridge and the page": lambda message: from_plain(to_plain(message, exact=True), type(message)),
    "JSON": lambda message: to_json(message),
}


@pytest.mark.parametrize("way", WAYS)
@pytest.mark.parametrize("name", CASES)
def test_every_encoding_takes_them(name: str, way: str) -> None:
    """Each encoding gives the same for the values of numpy as for Python's own."""
    case, encoded = CASES[name], WAYS[way]
    found, expected = (encoded(published(case.make(value))) for value in (case.given, case.plain))
    if way == "JSON":
        assert found == expected
    else:
        assert same(case.read(found), case.read(expected))


def wrong(kind: Any, **values: Any) -> Any:
    """A message of this kind whose values need not have the right types."""
    return kind(**values)


BIG = np.array([1.0, 1e39])
STAMPED = TransformStamped(wrong(Header, frame_id=3))
FLOAT32 = r"must be from -3.40282e\+38 to 3.40282e\+38 \(float32\), not 1e\+39"
REFUSED = {
    "text as a number": (Twist(wrong(Vector3, x="fast")), "linear.x must be a number, not str 'fast'"),
    "nothing as a number": (wrong(Float64, data=None), "data must be a number, not None"),
    "a flag as a number": (Float64(True), "data must be a number, not bool True"),
    "an array as a number": (wrong(Float64, data=np.zeros(1)), "data must be a number, not an array of "),
    "a tuple as a vector": (wrong(Twist, linear=(1.0, 0.0)), r"linear must be a Vector3, not tuple \(1.0"),
    "another message": (wrong(Imu, orientation=Vector3()), "orientation must be a Quaternion, not Vector3"),
    "a float as an integer": (wrong(Image, height=480.0), "height must be an integer, not float 480.0"),
    "NaN as an integer": (wrong(Image, width=np.float32("nan")), "width must be an integer, not float32 "),
    "a negative size": (Image(height=-1), r"height must be from 0 to 4294967295 \(uint32\), not -1"),
    "a large integer": (Time(2**31), r"sec must be from -2147483648 to 2147483647 \(int32\)"),
    "a large uint8": (Image(is_bigendian=256), r"is_bigendian must be from 0 to 255 \(uint8\), not 256"),
    "a large int8": (wrong(NavSatStatus, status=np.int64(128)), r"status must be from -128 to 127 \(int8\)"),
    "a large float32": (ColorRGBA(r=1e39), f"r {FLOAT32}"),
    "a huge integer": (Float64(10**400), "data must be a number below 1.8e308"),
    "a number as a flag": (wrong(Bool, data=2), "data must be True or False, not int 2"),
    "a number as text": (wrong(String, data=5), "data must be a string, not int 5"),
    "bytes as text": (wrong(String, data=b"a"), "data must be a string, not bytes b'a'"),
    "rows of ranges": (wrong(LaserScan, ranges=np.zeros((2, 3))), r"ranges must have one dim.*\(2, 3\)"),
    "unequal rows": (wrong(LaserScan, ranges=[[1], [1, 2]]), "ranges must be an array or a list of numbers"),
    "ranges of text": (wrong(LaserScan, ranges=["a"]), "ranges must have numbers of type float32"),
    "one range": (wrong(LaserScan, ranges=1.0), "ranges must be an array or a list, not float 1.0"),
    "a large range": (wrong(LaserScan, ranges=BIG), rf"ranges\[1\] {FLOAT32}"),
    "a large cell": (wrong(OccupancyGrid, data=[0, 255]), r"data\[1\] must be from -128 to 127 \(int8\)"),
    "NaN as a cell": (wrong(OccupancyGrid, data=[math.nan]), "data must have numbers of type int8"),
    "a float image": (wrong(Image, data=np.zeros(4)), "data must be bytes or an array of uint8, .*tobytes"),
    "numbers above 255": (wrong(Image, data=[300]), "data must be bytes or numbers from 0 to 255"),
    "a number as bytes": (wrong(PointCloud2, data=5), "data must be bytes or an array of uint8, not int 5"),
    "a matrix of covariances": (_covariance(np.eye(6)), r"pose.covariance must have one dim.*\(6, 6\)"),
    "too few covariances": (_covariance((0.0,) * 35), "pose.covariance must have 36 numbers, not 35"),
    "no covariances": (_covariance(()), "pose.covariance must have 36 numbers, not 0"),
    "too many of k": (CameraInfo(k=(0.0,) * 12), "k must have 9 numbers, not 12"),
    "text in a list": (wrong(JointState, position=(0.0, "b")), r"position\[1\] must be a number, not str"),
    "text as a list": (wrong(JointState, name="wheel"), "name must be a list, not str 'wheel'"),
    "a set as a list": (wrong(JointState, position={1.0}), r"position must be a list, not set \{1.0\}"),
    "a float button": (wrong(Joy, buttons=np.array([0.5])), r"buttons\[0\] must be an integer, not float"),
    "in a list": (
        TFMessage((TransformStamped(), STAMPED)),
        r"transforms\[1\].header.frame_id must be a string, not int 3",
    ),
}


@pytest.mark.parametrize("name", REFUSED)
def test_other_values_are_refused_with_the_path_of_the_field(name: str) -> None:
    message, problem = REFUSED[name]
    bus, received = Bus(), list[Any]()
    bus.subscribe("topic", type(message), received.append)
    with pytest.raises(KbotError, match=rf"^{type(message).__name__}\.{problem}"):
        bus.advertise("topic", type(message)).publish(message)
    assert received == []


def test_a_plain_message_is_published_itself() -> None:
    marker = Marker(Header(Time(1, 2), "map"), color=ColorRGBA(1.0))
    for message in (Twist(), Odometry(), Imu(), LaserScan(), marker, TFMessage((TransformStamped(),))):
        assert checked(message) is message
    message = Odometry(pose=PoseWithCovariance(covariance=(0.5,) * 36))
    assert checked(message) is checked(message) is message


def test_objects_that_are_no_messages_are_not_checked() -> None:
    marker = object()
    assert checked(marker) is marker


@pytest.mark.parametrize("name", [n for names in NAMESAKES.values() for n in names.split()])
def test_field_types_are_those_of_ros_2(name: str) -> None:
    """The expected types are from the definitions in the rosbags library, which are copied from ROS."""
    package = next(package for package, names in NAMESAKES.items() if name in names.split())
    ros = f"{package}/msg/{name}"
    kind = known_type(ros)
    assert kind is not None
    assert ros_name(kind) == ros
    expected = {}
    for field, (outer, inner) in shipped_types().fielddefs[ros][1]:
        length = ""
        if outer in (Nodetype.ARRAY, Nodetype.SEQUENCE):
            (outer, inner), count = inner
            length = f"[{count or ''}]"
        base = inner if outer == Nodetype.NAME else inner[0]
        expected[field] = str(base).replace("/msg/", "/") + length
    expected = {key: {"octet[]": "uint8[]", "octet": "uint8"}.get(of, of) for key, of in expected.items()}
    assert dict(fields(kind, ros1=False)) == expected


def test_the_class_of_an_array_shows_in_its_type_hint() -> None:
    """From numpy 2.5 on, `get_origin` of `numpy.typing.NDArray` is a `TypeAliasType` and not a class."""
    names = [f"{package}/msg/{name}" for package, names in NAMESAKES.items() for name in names.split()]
    kinds = [kind for name in names if (kind := known_type(name)) is not None]
    hints = [str(field.type) for kind in kinds for field in dataclass_fields(kind)]
    assert "Array[np.float32]" in hints
    assert not [hint for hint in hints if "NDArray" in hint]


def test_arrays_are_not_walked_element_by_element() -> None:
    calls = 0

    def count(*_: object) -> None:
        nonlocal calls
        calls += 1

    pixels, ranges = np.zeros((1000, 1000), np.uint8), np.zeros(100_000)
    checked(Image()), checked(LaserScan())  # the checks of both types are made
    sys.setprofile(count)
    try:
        checked(Image(data=pixels))
        checked(LaserScan(ranges=ranges))
    finally:
        sys.setprofile(None)
    assert calls < 1000
