"""A ROS 2 node over DDS. Needs the extra `ros2`."""

from __future__ import annotations

import os
import shutil
from importlib.util import find_spec
from typing import TYPE_CHECKING

from kbot.ros.bridges.kind import BridgeKind
from kbot.text import KbotError
from kbot.text.extras import needs_extra

if TYPE_CHECKING:
    from kbot.ros.bridges.link import PeerLink
    from kbot.ros.bridges.ros2.bridge import Ros2Bridge


def open_bridge(
    link: PeerLink,
    host: str | None,
    node: str = "/kbot",
    *,
    domain: int | None = None,
    lossless: bool = False,
) -> Ros2Bridge:
    """Connect as the node `node`; see `Ros2Bridge`.

    Raises:
        KbotError: the extra is not installed, or DDS cannot be served.
    """
    try:
        from kbot.ros.bridges.ros2.bridge import Ros2Bridge  # needs the extra
    except ModuleNotFoundError as error:
        if (error.name or "").partition(".")[0] != "cyclonedds":
            raise
        raise KbotError(needs_extra("ROS 2", "ros2")) from None
    return Ros2Bridge(link, host, node, domain=domain, lossless=lossless)


def _why_no_peer() -> str:
    if find_spec("cyclonedds") is None:
        return needs_extra("ROS 2", "ros2")
    if os.environ.get("RMW_IMPLEMENTATION") == "rmw_zenoh_cpp":
        return "RMW_IMPLEMENTATION selects Zenoh"
    if os.environ.get("ROS_AUTOMATIC_DISCOVERY_RANGE") == "OFF":
        return "ROS_AUTOMATIC_DISCOVERY_RANGE is OFF"
    if os.environ.get("ROS_VERSION") == "2" or os.environ.get("ROS_DOMAIN_ID") or shutil.which("ros2"):
        return ""
    return "no ros2 command and no ROS_DOMAIN_ID found"


KIND = BridgeKind(
    "ros2",
    "ROS 2",
    "Connect as a ROS 2 node over DDS. Needs the extra ros2.",
    open_bridge,
    _why_no_peer,
)
