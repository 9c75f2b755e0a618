"""The key expressions of rmw_zenoh for topics, services and liveliness tokens."""

from __future__ import annotations

import struct

VOLATILE, LATCHED, OF_PARAMETERS = "::,10:,:,:,,", ":1:,1:,:,:,,", "::,1000:,:,:,,"
"""Qualities of service: what is left out is as usual, and 1 is transient local."""

ATTACHED = struct.Struct("<qqB16s")
"""What goes along with each message, request and response: its number, the time in ns, 16 and the mark of the
sender; with a response the number and the mark are those of the request."""


def type_key(name: str, digest: str) -> str:
    """What stands for a type in keys: `nav_msgs/msg/Odometry` is `nav_msgs::msg::dds_::Odometry_`, and its
    hash."""
    package, folder, short = name.split("/")
    return f"{package}::{folder}::dds_::{short}_/{digest}"


def topic_key(domain: int, name: str, kind: str) -> str:
    """Where messages of a topic, or calls of a service, go; `kind` as `type_key` has it."""
    return f"{domain}/{name.lstrip('/')}/{kind}"


def node_token(domain: int, session: str, node: str) -> str:
    """That a node of the root namespace is there."""
    return f"@ros2_lv/{domain}/{session}/0/0/NN/%/%/{node}"


def entity_token(
    domain: int, session: str, number: int, role: str, node: str, name: str, kind: str, quality: str
) -> str:
    """That a node publishes (`role` MP), subscribes (MS) or serves (SS)."""
    what = f"{name.replace('/', '%')}/{kind}/{quality}"
    return f"@ros2_lv/{domain}/{session}/0/{number}/{role}/%/%/{node}/{what}"
