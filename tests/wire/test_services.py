"""Service types: MD5 sums of Gazebo's own packages, and bytes that survive a round trip."""

import pytest
from rosbags.interfaces import Nodetype

from kbot.messages import services as srv
from kbot.messages import types as msg
from kbot.record.encodings.serialization import decode_cdr, decode_ros1, encode_cdr, encode_ros1
from kbot.ros.service_types import hash_of_service, service_type
from kbot.text import KbotError


@pytest.mark.parametrize(
    ("name", "md5"),
    [
        # from the code that ROS noetic generates
        ("std_srvs/Empty", "d41d8cd98f00b204e9800998ecf8427e"),
        ("gazebo_msgs/SpawnModel", "9ed9c82c96abe1a00c3e8cdaeee24413"),
        ("gazebo_msgs/GetModelState", "4c515e936d3319c9610c559c60bfc3d4"),
        ("gazebo_msgs/ApplyBodyWrench", "585b9f9618aa0581b207e2f2d90866bc"),
    ],
)
def test_md5_sums_match_gazebo(name: str, md5: str) -> None:
    assert service_type(name).md5 == md5


def test_requests_with_and_without_fields_are_encoded() -> None:
    kind = service_type("gazebo_msgs/srv/SpawnModel")
    request = srv.SpawnModelRequest("a", "<x/>", "", msg.Pose(msg.Point(1.0, 2.0, 3.0)), "map")
    assert decode_cdr(encode_cdr(request, kind.request_name), kind.request, kind.request_name) == request
    assert decode_ros1(encode_ros1(request, kind.request_name), kind.request, kind.request_name) == request
    empty = service_type("std_srvs/Empty").request_name
    assert encode_ros1(srv.EmptyRequest(), empty) == b""
    assert (
        encode_cdr(srv.EmptyRequest(), empty) == b"\0\1\0\0\0"
    )  # ROS 2 writes one byte for an empty message


def test_unknown_service_type_is_refused() -> None:
    with pytest.raises(KbotError, match="did you mean 'gazebo_msgs/SpawnModel'"):
        service_type("gazebo_msgs/SpawnModle")


def test_hash_of_a_service_type_matches_ros_2() -> None:
    """example_interfaces/srv/AddTwoInts from ROS 2 Jazzy."""
    number = (Nodetype.BASE, ("int64", 0))
    found = hash_of_service("example_interfaces/srv/AddTwoInts", {"a": number, "b": number}, {"sum": number})
    assert found == "RIHS01_e118de6bf5eeb66a2491b5bda11202e7b68f198d6f67922cf30364858239c81a"
