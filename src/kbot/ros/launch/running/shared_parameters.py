"""Gives the parameters of a launch to peers and a ROS 1 master, and writes them to files."""

from __future__ import annotations

import os
from contextlib import suppress
from dataclasses import replace

from kbot.ros.launch.plan import Plan
from kbot.ros.peer_options import PeerOptions
from kbot.text import KbotError

_CALLER = "/kbot_launch"


def with_parameters(plan: Plan, peers: PeerOptions) -> PeerOptions:
    """The peers, with the parameters of the launch."""
    values = {name: param.value for name, param in plan.params.items() if _is_portable(param.value)}
    return replace(peers, parameters=values)


def _is_portable(value: object) -> bool:
    """Whether all kinds of peers accept a value. XML-RPC does not have None or integers above 32 bits."""
    if isinstance(value, list):
        return all(map(_is_portable, value))
    if isinstance(value, int):
        return -(1 << 31) <= value < 1 << 31
    return isinstance(value, str | float)


def dump_parameters(plan: Plan) -> None:
    """Write the files of `<rosparam command="dump">`."""
    from kbot.ros.parameter_values import dump_yaml  # imported lazily, for a fast start-up
    from kbot.text.files import write_text

    for command, name, file in plan.store:
        if command == "dump":
            values = {key: param.value for key, param in plan.params.items()}
            write_text(file, dump_yaml(values, name))


def clear_on_master(plan: Plan) -> None:
    """Delete parameters on the ROS 1 master as roslaunch does: first those of `<rosparam command="delete">`,
    then those of `clear_params`. Without a master, do nothing."""
    from kbot.ros.bridges.ros1.rpc import RpcFailed, call  # imported lazily: only ROS 1 needs it

    deleted = [name for command, name, _ in plan.store if command == "delete"]
    for name in (*deleted, *plan.clear):
        with suppress(RpcFailed):  # the parameter is not set
            call(_master(), "deleteParam", _CALLER, name)


def set_on_master(plan: Plan) -> None:
    """Set the launch's parameters on the ROS 1 master.

    Raises:
        KbotError: no master is running.
    """
    from kbot.ros.bridges.ros1.rpc import RpcFailed, call  # only with ROS 1

    clear_on_master(plan)
    try:
        for name, param in plan.params.items():
            call(_master(), "setParam", _CALLER, name, param.value)
    except RpcFailed as failed:
        raise KbotError(f"{failed}: start roscore, or kbot sim kbot --ros1") from None


def _master() -> str:
    from kbot.ros.bridges.ros1.bridge import DEFAULT_MASTER

    return os.environ.get("ROS_MASTER_URI") or DEFAULT_MASTER
