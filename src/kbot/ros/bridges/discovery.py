"""Which bridges have somebody to speak to: for `--bridges auto`."""

from __future__ import annotations

import os
import shutil
import socket
from collections.abc import Callable
from importlib.util import find_spec

from kbot.ros.bridges.ros1.rpc import RpcFailed, call

MASTER = "http://localhost:11311/"
ROUTER_PORT = 7447
LOOK_SECONDS = 0.3


def peers_around() -> tuple[tuple[str, ...], tuple[str, ...]]:
    """The bridges that are worth opening, by the names of their flags, and in words why not the others.
    Foxglove and rosbridge are servers, to which peers come at any time."""
    found, missing = [], []
    looks: dict[str, Callable[[], str]] = {"ros1": _ros1, "ros2": _ros2, "zenoh": _zenoh}
    for name, look in looks.items():
        why_not = look()
        if why_not:
            missing.append(f"{name}: {why_not}")
        else:
            found.append(name)
    return (*found, "foxglove", "rosbridge"), tuple(missing)


def _ros1() -> str:
    uri = os.environ.get("ROS_MASTER_URI") or MASTER
    try:
        call(uri, "getPid", "/kbot")
    except RpcFailed:
        return f"no master answers at {uri}"
    return ""


def _ros2() -> str:
    if find_spec("cyclonedds") is None:
        return "it needs an extra, pip install 'kbot[ros2]'"
    if os.environ.get("RMW_IMPLEMENTATION") == "rmw_zenoh_cpp":
        return "RMW_IMPLEMENTATION says Zenoh"
    if os.environ.get("ROS_VERSION") == "2" or os.environ.get("ROS_DOMAIN_ID") or shutil.which("ros2"):
        return ""
    return "there is no ros2 here, and no ROS_DOMAIN_ID"


def _zenoh() -> str:
    if find_spec("zenoh") is None:
        return "it needs an extra, pip install 'kbot[zenoh]'"
    if os.environ.get("ZENOH_CONNECT"):
        return ""
    try:
        socket.create_connection(("127.0.0.1", ROUTER_PORT), LOOK_SECONDS).close()
    except OSError:
        return f"no router answers on port {ROUTER_PORT}"
    return ""
