"""A ROS 2 node over Zenoh. Needs the extra `zenoh`."""

from __future__ import annotations

import os
import socket
from importlib.util import find_spec
from typing import TYPE_CHECKING

from kbot.ros.bridges.kind import BridgeKind
from kbot.text import KbotError
from kbot.text.extras import needs_extra

if TYPE_CHECKING:
    from kbot.ros.bridges.link import PeerLink
    from kbot.ros.bridges.zenoh.bridge import ZenohBridge

ROUTER_PORT = 7447
_CONNECT_TIMEOUT = 0.3
"""Seconds; a router on this machine accepts at once."""


def _open(link: PeerLink, host: str | None) -> ZenohBridge:
    try:
        from kbot.ros.bridges.zenoh.bridge import ZenohBridge  # needs the extra
    except ModuleNotFoundError as error:
        if error.name != "zenoh":
            raise
        raise KbotError(needs_extra("Zenoh", "zenoh")) from None
    return ZenohBridge(link, host)


def _why_no_peer() -> str:
    if find_spec("zenoh") is None:
        return needs_extra("Zenoh", "zenoh")
    if os.environ.get("ZENOH_CONNECT"):
        return ""
    try:
        socket.create_connection(("127.0.0.1", ROUTER_PORT), _CONNECT_TIMEOUT).close()
    except OSError:
        return f"no router answers on port {ROUTER_PORT}"
    return ""


KIND = BridgeKind(
    "zenoh",
    "Zenoh",
    "Connect as a ROS 2 node over Zenoh. Needs the extra zenoh.",
    _open,
    _why_no_peer,
)
