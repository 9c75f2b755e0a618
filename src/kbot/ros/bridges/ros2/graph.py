"""How a node of ROS 2 says over DDS that it is there: which writers and readers are its own."""

from __future__ import annotations

import struct

GRAPH_TOPIC = "ros_discovery_info"
GRAPH_TYPE = "rmw_dds_common/msg/ParticipantEntitiesInfo"
GID_BYTES = 16
"""As from ROS 2 Iron on; Humble has 24."""


def node_message(participant: bytes, node: str, readers: list[bytes], writers: list[bytes]) -> bytes:
    """The message, in CDR, of a participant with one node of that full name; GUIDs are 16 bytes."""
    namespace, _, name = node.rpartition("/")
    body = _gid(participant) + struct.pack("<I", 1)
    body = _text(_text(body, namespace or "/"), name)
    for gids in (readers, writers):
        body += b"\0" * (-len(body) % 4) + struct.pack("<I", len(gids)) + b"".join(map(_gid, gids))
    return b"\0\1\0\0" + body


def _gid(guid: bytes) -> bytes:
    return guid.ljust(GID_BYTES, b"\0")[:GID_BYTES]


def _text(body: bytes, text: str) -> bytes:
    body += b"\0" * (-len(body) % 4)
    return body + struct.pack("<I", len(text) + 1) + text.encode() + b"\0"
