"""TCPROS headers, parameters and the master's registry, by hand and against what ROS says of them."""

import struct

import pytest
from hypothesis import given
from hypothesis import strategies as st

from kbot.ros.bridges.ros1.master import Registry
from kbot.ros.bridges.ros1.parameter_server import ParameterServer, resolve
from kbot.ros.bridges.ros1.tcpros import ProtocolError, check_header, decode_header, encode_header

NAMES = st.text(st.characters(exclude_characters="=", exclude_categories=("Cs",)), min_size=1)
VALUES = st.text(st.characters(exclude_categories=("Cs",)))


def test_a_header_by_hand() -> None:
    """As http://wiki.ros.org/ROS/Connection%20Header lays it out."""
    line = b"latching=1"
    assert encode_header({"latching": "1"}) == struct.pack("<II", 14, 10) + line


@given(st.dictionaries(NAMES, VALUES))
def test_a_header_comes_back(fields: dict[str, str]) -> None:
    assert decode_header(encode_header(fields)[4:]) == fields


@given(st.binary(max_size=200))
def test_any_bytes_are_a_header_or_an_error(data: bytes) -> None:
    try:
        fields = decode_header(data)
    except ProtocolError:
        return
    assert all(isinstance(key, str) for key in fields)


@pytest.mark.parametrize(
    "wrong", [{"type": "std_msgs/String"}, {"md5sum": "0"}, {"topic": "/other"}, {"error": "no"}]
)
def test_another_type_sum_or_topic_is_refused(wrong: dict[str, str]) -> None:
    right = {"topic": "/odom", "type": "nav_msgs/Odometry", "md5sum": "cd5e"}
    check_header(right, "/odom", "nav_msgs/Odometry", "cd5e")
    check_header({"topic": "/odom", "type": "*", "md5sum": "*"}, "/odom", "nav_msgs/Odometry", "cd5e")
    with pytest.raises(ProtocolError):
        check_header({**right, **wrong}, "/odom", "nav_msgs/Odometry", "cd5e")


def test_parameters_are_a_tree() -> None:
    found = ParameterServer()
    found.set("/a/b/c", 1)
    found.set("/a/d", [1, "x"])
    assert found.get("/") == {"a": {"b": {"c": 1}, "d": [1, "x"]}}
    assert found.names() == ["/a/b/c", "/a/d"]
    found.set("/a/d/e", 2)
    assert found.get("/a/d") == {"e": 2}
    found.delete("/a/b")
    assert found.get("/a") == {"d": {"e": 2}}
    for name in ("/a/b/c", "/x", "/a/d/e/f"):
        with pytest.raises(KeyError):
            found.get(name)
    with pytest.raises(KeyError):
        found.delete("/a/b")


def test_a_parameter_is_searched_upwards() -> None:
    """The example of http://wiki.ros.org/Parameter%20Server on searching."""
    found = ParameterServer()
    found.set("/camera/resolution", 1)
    found.set("/robot/name", "r2")
    assert found.search("/camera/left/driver", "resolution") == "/camera/resolution"
    assert found.search("/robot/arm", "name/first") == "/robot/name/first"
    with pytest.raises(KeyError):
        found.search("/robot", "resolution")


def test_names_are_resolved_as_a_node_means_them() -> None:
    assert resolve("/a", "/ns/node") == "/a"
    assert resolve("a/b", "/ns/node") == "/ns/a/b"
    assert resolve("~a", "/ns/node") == "/ns/node/a"
    assert resolve("", "/ns/node") == "/"


def test_a_node_that_starts_elsewhere_replaces_the_one_before() -> None:
    registry = Registry()
    assert registry.join("/n", "http://one/") is None
    registry.publishers.add("/t", "/n", "http://one/")
    assert registry.join("/n", "http://two/") == "http://one/"
    assert registry.publishers.uris("/t") == []
    registry.publishers.add("/t", "/n", "http://two/")
    assert not registry.publishers.remove("/t", "/n", "http://one/")
    assert registry.publishers.uris("/t") == ["http://two/"]


def test_who_speaks_says_what_type_a_topic_has() -> None:
    registry = Registry()
    registry.set_type("/t", "*", is_spoken=False)
    registry.set_type("/t", "std_msgs/String", is_spoken=True)
    registry.set_type("/t", "std_msgs/Int8", is_spoken=False)
    registry.set_type("/t", "*", is_spoken=True)
    assert registry.types() == [["/t", "std_msgs/String"]]
