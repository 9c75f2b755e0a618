"""A server for roslibjs and roslibpy: the rosbridge protocol."""

from __future__ import annotations

from typing import TYPE_CHECKING

from kbot.ros.bridges.kind import BridgeKind

if TYPE_CHECKING:
    from kbot.ros.bridges.link import PeerLink
    from kbot.ros.bridges.rosbridge.bridge import RosbridgeBridge


def _open(link: PeerLink, host: str | None) -> RosbridgeBridge:
    from kbot.ros.bridges.rosbridge.bridge import (
        RosbridgeBridge,  # when opened: websockets takes start-up time
    )

    return RosbridgeBridge(link, host)


KIND = BridgeKind(
    "rosbridge",
    "rosbridge",
    "Start a server for roslibjs and roslibpy on port 9090, or the next free port.",
    _open,
)
