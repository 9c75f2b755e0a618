"""TCPROS headers, the parameter server and the master's registry, against the documentation of ROS."""

import struct

import pytest
from hypothesis import given
from hypothesis import strategies as st

from kbot.ros.bridges.ros1.master import Registry
from kbot.ros.bridges.ros1.parameter_server import ParameterServer, resolve
from kbot.ros.bridges.ros1.tcpros import ProtocolError, check_header, decode_header, encode_header

NAMES = st.text(st.characters(exclude_characters="=", exclude_categories=("Cs",)), min_size=1)
VALUES = st.text(st.characters(exclude_categories=("Cs",)))


def test_encoded_header() -> None:
    """The format of http://wiki.ros.org/ROS/Connection%20Header."""
    line = b"latching=1"
    assert encode_header({"latching": "1"}) == struct.pack("<II", 14, 10) + line


@given(st.dictionaries(NAMES, VALUES))
def test_header_round_trip(fields: dict[str, str]) -> None:
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
def test_a_header_with_another_type_sum_or_topic_is_refused(wrong: dict[str, str]) -> None:
    right = {"topic": "/odom", "type": "nav_msgs/Odometry", "md5sum": "cd5e"}
    check_header(right, "/odom", "nav_msgs/Odometry", "cd5e")
    check_header({"topic": "/odom", "type": "*", "md5sum": "*"}, "/odom", "nav_msgs/Odometry", "cd5e")
    with pytest.raises(ProtocolError):
        check_header({**right, **wrong}, "/odom", "nav_msgs/Odometry", "cd5e")


def test_parameters_are_a_tree() -> None:
    server = ParameterServer()
    server.set("/a/b/c", 1)
    server.set("/a/d", [1, "x"])
    assert server.get("/") == {"a": {"b": {"c": 1}, "d": [1, "x"]}}
    assert server.names() == ["/a/b/c", "/a/d"]
    server.set("/a/d/e", 2)
    assert server.get("/a/d") == {"e": 2}
    server.delete("/a/b")
    assert server.get("/a") == {"d": {"e": 2}}
    for name in ("/a/b/c", "/x", "/a/d/e/f"):
        with pytest.raises(KeyError):
            server.get(name)
    with pytest.raises(KeyError):
        server.delete("/a/b")


def test_search_looks_in_all_namespaces_above() -> None:
    """The example of http://wiki.ros.org/Parameter%20Server."""
    server = ParameterServer()
    server.set("/camera/resolution", 1)
    server.set("/robot/name", "r2")
    assert server.search("/camera/left/driver", "resolution") == "/camera/resolution"
    assert server.search("/robot/arm", "name/first") == "/robot/name/first"
    with pytest.raises(KeyError):
        server.search("/robot", "resolution")


def test_names_are_resolved_relative_to_the_node() -> None:
    assert resolve("/a", "/ns/node") == "/a"
    assert resolve("a/b", "/ns/node") == "/ns/a/b"
    assert resolve("~a", "/ns/node") == "/ns/node/a"
    assert resolve("", "/ns/node") == "/"


def test_a_node_replaces_an_earlier_one_of_the_same_name() -> None:
    registry = Registry()
    assert registry.add_node("/n", "http://one/") is None
    registry.publishers.add("/t", "/n", "http://one/")
    assert registry.add_node("/n", "http://two/") == "http://one/"
    assert registry.publishers.uris("/t") == []
    registry.publishers.add("/t", "/n", "http://two/")
    assert not registry.publishers.remove("/t", "/n", "http://one/")
    assert registry.publishers.uris("/t") == ["http://two/"]


def test_publishers_set_the_type_of_a_topic() -> None:
    registry = Registry()
    registry.set_type("/t", "*", is_publisher=False)
    registry.set_type("/t", "std_msgs/String", is_publisher=True)
    registry.set_type("/t", "std_msgs/Int8", is_publisher=False)
    registry.set_type("/t", "*", is_publisher=True)
    assert registry.types() == [["/t", "std_msgs/String"]]
