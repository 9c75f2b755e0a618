"""A ROS 1 node, and a master if none is running, over the standard library's XML-RPC and sockets."""

from __future__ import annotations

import os
from typing import TYPE_CHECKING

from kbot.ros.bridges.kind import BridgeKind

if TYPE_CHECKING:
    from kbot.ros.bridges.link import PeerLink
    from kbot.ros.bridges.ros1.bridge import Ros1Bridge


def _open(link: PeerLink, host: str | None) -> Ros1Bridge:
    from kbot.ros.bridges.ros1.bridge import Ros1Bridge  # imported lazily, for a fast start-up

    return Ros1Bridge(link, host)


def _why_no_peer() -> str:
    from kbot.ros.bridges.ros1.bridge import DEFAULT_MASTER
    from kbot.ros.bridges.ros1.rpc import RpcFailed, call

    uri = os.environ.get("ROS_MASTER_URI") or DEFAULT_MASTER
    try:
        call(uri, "getPid", "/kbot")
    except RpcFailed:
        return f"no master answers at {uri}"
    return ""


KIND = BridgeKind(
    "ros1", "ROS 1", "Connect as a ROS 1 node; start a master if none is running.", _open, _why_no_peer
)
