"""The key expressions of rmw_zenoh for topics, services and liveliness tokens."""

from __future__ import annotations

import struct

VOLATILE, LATCHED, PARAMETERS = "::,10:,:,:,,", ":1:,1:,:,:,,", "::,1000:,:,:,,"
"""QoS of tokens: reliability, durability, history and depth, then others. Empty fields have the default.
Durability 1 is transient local."""

ATTACHED = struct.Struct("<qqB16s")
"""The attachment of each message, request and response: its number, the time in ns, and the GID of the sender
with its length 16. A response has the number and the GID of its request."""


def type_key(name: str, digest: str) -> str:
    """The part of a key for a type: `nav_msgs/msg/Odometry` is `nav_msgs::msg::dds_::Odometry_/HASH`."""
    package, folder, short = name.split("/")
    return f"{package}::{folder}::dds_::{short}_/{digest}"


def topic_key(domain: int, name: str, kind: str) -> str:
    """The key of a topic or service. `kind` is its `type_key`."""
    return f"{domain}/{name.lstrip('/')}/{kind}"


def node_token(domain: int, session: str, node: str) -> str:
    """The liveliness token of a node in the root namespace."""
    return f"@ros2_lv/{domain}/{session}/0/0/NN/%/%/{node}"


def entity_token(
    domain: int, session: str, number: int, role: str, node: str, name: str, kind: str, quality: str
) -> str:
    """The liveliness token of a publisher (`role` MP), subscriber (MS) or service (SS) of a node."""
    what = f"{name.replace('/', '%')}/{kind}/{quality}"
    return f"@ros2_lv/{domain}/{session}/0/{number}/{role}/%/%/{node}/{what}"
