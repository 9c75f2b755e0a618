"""Types of services: sums as Gazebo's own packages have them, and bytes that come back."""

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
        # of the code that ROS generates for noetic
        ("std_srvs/Empty", "d41d8cd98f00b204e9800998ecf8427e"),
        ("gazebo_msgs/SpawnModel", "9ed9c82c96abe1a00c3e8cdaeee24413"),
        ("gazebo_msgs/GetModelState", "4c515e936d3319c9610c559c60bfc3d4"),
        ("gazebo_msgs/ApplyBodyWrench", "585b9f9618aa0581b207e2f2d90866bc"),
    ],
)
def test_sums_are_those_of_gazebo(name: str, md5: str) -> None:
    assert service_type(name).md5 == md5


def test_both_encodings_of_a_request_and_of_nothing() -> None:
    kind = service_type("gazebo_msgs/srv/SpawnModel")
    request = srv.SpawnModelRequest("a", "<x/>", "", msg.Pose(msg.Point(1.0, 2.0, 3.0)), "map")
    assert decode_cdr(encode_cdr(request, kind.request_name), kind.request, kind.request_name) == request
    assert decode_ros1(encode_ros1(request, kind.request_name), kind.request, kind.request_name) == request
    empty = service_type("std_srvs/Empty").request_name
    assert encode_ros1(srv.EmptyRequest(), empty) == b""
    assert encode_cdr(srv.EmptyRequest(), empty) == b"\0\1\0\0\0"  # ROS 2 has a byte where nothing is


def test_an_unknown_type() -> None:
    with pytest.raises(KbotError, match="did you mean 'gazebo_msgs/SpawnModel'"):
        service_type("gazebo_msgs/SpawnModle")


def test_the_hash_of_a_service_s_type_is_that_of_ros_2() -> None:
    """example_interfaces/srv/AddTwoInts, as ROS 2 Jazzy installs it."""
    number = (Nodetype.BASE, ("int64", 0))
    found = hash_of_service("example_interfaces/srv/AddTwoInts", {"a": number, "b": number}, {"sum": number})
    assert found == "RIHS01_e118de6bf5eeb66a2491b5bda11202e7b68f198d6f67922cf30364858239c81a"
