"""What rmw_zenoh calls topics, services and the tokens by which a node says that it is there."""

from __future__ import annotations

from kbot.wire import ros2_definition
from kbot.wire.services import service_hash

VOLATILE, LATCHED = "::,10:,:,:,,", ":1:,1:,:,:,,"
"""Qualities of service: what is left out is as usual, and 1 is transient local."""


def topic_key(domain: int, name: str, type_name: str) -> str:
    """Where messages of a topic, or calls of a service, go."""
    return f"{domain}/{name.lstrip('/')}/{_dds(type_name)}/{_hash(type_name)}"


def node_token(domain: int, session: str, node: str) -> str:
    """That a node of the root namespace is there."""
    return f"@ros2_lv/{domain}/{session}/0/0/NN/%/%/{node}"


def entity_token(
    domain: int,
    session: str,
    number: int,
    kind: str,
    node: str,
    name: str,
    type_name: str,
    *,
    latched: bool = False,
) -> str:
    """That a node publishes (`kind` MP), subscribes (MS) or serves (SS)."""
    what = f"{name.replace('/', '%')}/{_dds(type_name)}/{_hash(type_name)}/{LATCHED if latched else VOLATILE}"
    return f"@ros2_lv/{domain}/{session}/0/{number}/{kind}/%/%/{node}/{what}"


def _dds(type_name: str) -> str:
    """`nav_msgs/msg/Odometry` is `nav_msgs::msg::dds_::Odometry_`."""
    package, folder, name = type_name.split("/")
    return f"{package}::{folder}::dds_::{name}_"


def _hash(type_name: str) -> str:
    return service_hash(type_name) if "/srv/" in type_name else ros2_definition(type_name)[1]
