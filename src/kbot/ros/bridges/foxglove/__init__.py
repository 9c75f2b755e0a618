"""A server for Foxglove and Lichtblick: the Foxglove WebSocket protocol."""

from __future__ import annotations

from typing import TYPE_CHECKING

from kbot.ros.bridges.kind import BridgeKind

if TYPE_CHECKING:
    from kbot.ros.bridges.foxglove.bridge import FoxgloveBridge
    from kbot.ros.bridges.link import PeerLink


def _open(link: PeerLink, host: str | None) -> FoxgloveBridge:
    from kbot.ros.bridges.foxglove.bridge import FoxgloveBridge  # when opened: websockets takes start-up time

    return FoxgloveBridge(link, host)


KIND = BridgeKind(
    "foxglove",
    "Foxglove",
    "Start a server for Foxglove and Lichtblick on port 8765, or the next free port.",
    _open,
)
