"""The programs that a launch runs beside a robot, or without one."""

from __future__ import annotations

import _thread
import os
import shutil
import tempfile
import time
from collections.abc import Iterator, Mapping, Sequence
from contextlib import ExitStack, contextmanager, suppress
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from kbot.cli.output import print_note
from kbot.ros.launch.running.processes import Process, Processes
from kbot.ros.launch.running.programs import Program, command_line, environment
from kbot.text import KbotError

if TYPE_CHECKING:
    from kbot.ros.launch import Plan, PlannedNode
    from kbot.ros.peer_options import PeerOptions

_LOOK_SECONDS = 0.1
_CALLER = "/kbot_launch"


def run_programs(plan: Plan, programs: Sequence[Program]) -> int:
    """Run programs without a robot, beside whatever is there already, until all have ended, a required one
    has, or Ctrl-C; the exit status.

    Raises:
        KbotError: they need a master of ROS 1, and none answers.
    """
    from kbot.ros.client import wanted_transport  # lazy in this module: most launches run no programs

    kind = wanted_transport(os.environ)
    with processes_of(plan, programs, {"KBOT_TRANSPORT": kind}) as built:
        if kind == "ros1":
            _tell_master(plan)
        processes = Processes(built, print_note, _thread.interrupt_main)
        try:
            with suppress(KeyboardInterrupt):
                while not processes.are_over:
                    time.sleep(_LOOK_SECONDS)
        finally:
            processes.close()
    return processes.status


def start_programs(
    stack: ExitStack, plan: Plan, programs: Sequence[Program], peers: PeerOptions
) -> Processes | None:
    """Start a launch's programs, until the stack is closed; None where there are none. Without a bridge they
    are beside a KBot that runs here. The end of a required one interrupts the main thread."""
    if not programs:
        return None
    kind = "ros2" if "ros2" in peers.bridges and "ros1" not in peers.bridges else "ros1"
    told = {"KBOT_TRANSPORT": kind if peers.is_live else "local"}
    built = stack.enter_context(processes_of(plan, programs, told))
    processes = Processes(built, print_note, _thread.interrupt_main)
    stack.callback(processes.close)
    return processes


def live_for_programs(programs: Sequence[Program], peers: PeerOptions) -> PeerOptions:
    """With a bridge for programs of the user's own to come in by, where none is asked for."""
    if not programs or peers.is_live:
        return peers
    from kbot.ros.client import wanted_transport

    speaks_2 = any("rclpy" in program.ros for program in programs)
    if speaks_2 or wanted_transport(os.environ) == "ros2":
        return replace(peers, bridges=("ros2",))
    return replace(peers, bridges=("ros1",))


def clear_on_master(plan: Plan) -> None:
    """Delete on the master of ROS 1 what a launch wants deleted first, by `<rosparam command="delete">` and
    then by `clear_params`, as roslaunch does; nothing where no master is."""
    from kbot.ros.bridges.ros1.rpc import RpcFailed, call

    deleted = [name for command, name, _ in plan.store if command == "delete"]
    for name in (*deleted, *plan.clear):
        with suppress(RpcFailed):  # there is no such parameter
            call(_master(), "deleteParam", _CALLER, name)


def _master() -> str:
    from kbot.ros.bridges.ros1.bridge import DEFAULT_MASTER

    return os.environ.get("ROS_MASTER_URI") or DEFAULT_MASTER


def _tell_master(plan: Plan) -> None:
    from kbot.ros.bridges.ros1.rpc import RpcFailed, call

    uri = _master()
    clear_on_master(plan)
    try:
        for name, param in plan.params.items():
            call(uri, "setParam", _CALLER, name, param.value)
    except RpcFailed as failed:
        raise KbotError(f"{failed}: start roscore, or kbot sim kbot --ros1") from None


def _words(plan: Plan, node: PlannedNode) -> list[str]:
    """A node's own parameters, where there is no store to have them from."""
    if plan.is_ros_2:
        return []  # they are in its parameter file
    return [f"_{name}:={value}" for name, value in _own(plan, node).items() if not isinstance(value, list)]


def _own(plan: Plan, node: PlannedNode) -> dict[str, Any]:
    prefix = f"{node.full_name}/"
    return {n.removeprefix(prefix): p.value for n, p in plan.params.items() if n.startswith(prefix)}


@contextmanager
def processes_of(plan: Plan, programs: Sequence[Program], told: Mapping[str, str]) -> Iterator[list[Process]]:
    """What is to be started; `told` is its environment where nothing else says otherwise. Of the folder of
    their logs and parameters, logs with something in them are all that stays."""
    folder = Path(tempfile.mkdtemp(prefix="kbot-launch-"))
    try:
        if any(program.node.output == "log" for program in programs):
            print_note(f'Nodes with output="log" write to {folder}')
        yield [_process(plan, program, folder, told) for program in programs]
    finally:
        if not any(log.stat().st_size for log in folder.glob("*.log")):
            shutil.rmtree(folder, ignore_errors=True)


def _process(plan: Plan, program: Program, logs: Path, told: Mapping[str, str]) -> Process:
    node = program.node
    stem = node.full_name.strip("/").replace("/", "-")
    log = logs / f"{stem}.log" if node.output == "log" else None
    command = command_line(program, plan, _parameter_file(plan, node, logs / f"{stem}.yaml"))
    if told.get("KBOT_TRANSPORT") == "local":
        command = [*command, *_words(plan, node)]
    return Process(
        name=node.full_name,
        command=command,
        environment={**told, **environment(program)},
        folder=_folder(node, program),
        log=log,
        respawn=node.respawn_delay if node.respawn else None,
        required=node.required,
        delay=node.delay,
        after=node.after,
    )


def _folder(node: PlannedNode, program: Program) -> str:
    """`cwd="node"` is the program's folder, ROS_HOME that of ROS; by default where the launch was begun."""
    if node.cwd == "node":
        return str(Path(program.file).parent)
    if node.cwd in ("ROS_HOME", "ros-root", "ros_home"):
        home = Path(os.environ.get("ROS_HOME") or Path.home() / ".ros")
        home.mkdir(parents=True, exist_ok=True)
        return str(home)
    return str(Path.cwd())


def _parameter_file(plan: Plan, node: PlannedNode, path: Path) -> str:
    """A file of ROS 2 with the node's parameters; none for ROS 1, where they are the master's."""
    own = _own(plan, node)
    if not plan.is_ros_2 or not own:
        return ""
    import yaml

    path.write_text(yaml.safe_dump({node.full_name: {"ros__parameters": own}}), encoding="utf-8")
    return str(path)
