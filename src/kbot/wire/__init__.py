"""Messages as bytes: the encodings of ROS 1 and ROS 2, each made once for all who send or record it."""

from kbot.wire.encoding import decode_cdr, decode_ros1, encode_cdr, encode_ros1
from kbot.wire.feed import Feed, Packet
from kbot.wire.names import ros_name
from kbot.wire.types import known_type, ros1_definition, ros2_definition

__all__ = [
    "Feed",
    "Packet",
    "decode_cdr",
    "decode_ros1",
    "encode_cdr",
    "encode_ros1",
    "known_type",
    "ros1_definition",
    "ros2_definition",
    "ros_name",
]
