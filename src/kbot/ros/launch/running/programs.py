"""Runs the user's own programs of a launch, beside a robot or without one."""

from __future__ import annotations

import _thread
import os
import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import ExitStack, contextmanager, suppress
from dataclasses import replace
from pathlib import Path

from kbot.ros.launch.node_arguments import split
from kbot.ros.launch.plan import Plan, PlannedNode
from kbot.ros.launch.quoting import split_words
from kbot.ros.launch.running.processes import Process, Processes
from kbot.ros.launch.running.shared_parameters import set_on_master
from kbot.ros.launch.user_program import Program
from kbot.ros.peer_options import PeerOptions
from kbot.text import Diagnostic
from kbot.text.temporary import TemporaryFolder

_POLL_S = 0.1
"""Seconds between two checks whether all programs have ended."""


def run_programs(plan: Plan, programs: Sequence[Program], note: Callable[[str], None]) -> int:
    """Run programs without a robot until all have exited, a required one has exited, or Ctrl-C. They connect
    to the ROS or KBot that is already running. Return the exit status.

    Raises:
        KbotError: they need a ROS 1 master, and none is running.
    """
    from kbot.ros.client import wanted_transport  # imported lazily: most launches run no programs

    kind = wanted_transport(os.environ)
    with _processes(plan, programs, {"KBOT_TRANSPORT": kind}, note) as built:
        if kind == "ros1":
            set_on_master(plan)
        processes = Processes(built, note, _thread.interrupt_main)
        try:
            with suppress(KeyboardInterrupt):
                while not processes.have_ended:
                    time.sleep(_POLL_S)
        finally:
            processes.close()
    return processes.status


def start_programs(
    stack: ExitStack,
    plan: Plan,
    programs: Sequence[Program],
    peers: PeerOptions,
    note: Callable[[str], None],
    failed: Callable[[Diagnostic], None] = lambda finding: None,
) -> Processes | None:
    """Start the programs of a launch, which run until the stack is closed. Without a bridge they connect to
    this KBot. The exit of a required one interrupts the main thread. `failed` receives a finding about each
    program that fails, on another thread. Return None if there are no programs."""
    if not programs:
        return None
    kind = "ros2" if "ros2" in peers.bridges and "ros1" not in peers.bridges else "ros1"
    defaults = {"KBOT_TRANSPORT": kind if peers.is_live else "local"}
    built = stack.enter_context(_processes(plan, programs, defaults, note))
    processes = Processes(built, note, _thread.interrupt_main, failed)
    stack.callback(processes.close)
    return processes


def live_for_programs(programs: Sequence[Program], peers: PeerOptions) -> PeerOptions:
    """The peers, with a bridge for the user's own programs if the user did not ask for a bridge."""
    if not programs or peers.is_live:
        return peers
    from kbot.ros.client import wanted_transport

    needs_ros_2 = any("rclpy" in program.ros for program in programs)
    if needs_ros_2 or wanted_transport(os.environ) == "ros2":
        return replace(peers, bridges=("ros2",))
    return replace(peers, bridges=("ros1",))


def command_line(program: Program, plan: Plan, parameter_file: str) -> list[str]:
    """The command line of a program, in the form of roslaunch or ros2 launch. `parameter_file` is for ROS 2
    and empty without parameters."""
    node = program.node
    prefix = split_words(node.launch_prefix) if node.launch_prefix else []
    words = [*prefix, program.interpreter, program.file, *split(node)]
    remaps = [f"{source}:={target}" for source, target in node.remaps]
    if plan.is_ros_2:
        words += ["--ros-args", "-r", f"__node:={node.name}"]
        words += [] if node.namespace == "/" else ["-r", f"__ns:={node.namespace.rstrip('/')}"]
        words += [word for remap in remaps for word in ("-r", remap)]
        return words + (["--params-file", parameter_file] if parameter_file else [])
    return [*words, *remaps, f"__name:={node.name}"]


def environment(program: Program) -> dict[str, str]:
    """The environment of a program: that of KBot and of the node, and the folders of its modules."""
    found = dict(os.environ)
    node = program.node
    source = Path(program.file).parents[1] / "src"
    folders = (str(source) if source.is_dir() else "", *program.module_folders, found.get("PYTHONPATH"))
    if any(folders):
        found["PYTHONPATH"] = os.pathsep.join(filter(None, folders))
    if node.namespace != "/":
        found["ROS_NAMESPACE"] = node.namespace.rstrip("/")
    found["PYTHONUNBUFFERED"] = "1"
    found.update(node.env)
    return found


@contextmanager
def _processes(
    plan: Plan, programs: Sequence[Program], defaults: Mapping[str, str], note: Callable[[str], None]
) -> Iterator[list[Process]]:
    """The processes to start, with `defaults` for their environment. Their logs and parameter files are in a
    folder, which is deleted at the end if all logs are empty."""
    temporary = TemporaryFolder("launch")
    with temporary as folder:
        if any(program.node.output == "log" for program in programs):
            note(f'Nodes with output="log" write to {folder}')
        try:
            yield [_process(plan, program, folder, defaults) for program in programs]
        finally:
            if any(log.stat().st_size for log in folder.glob("*.log")):
                temporary.keep()


def _process(plan: Plan, program: Program, logs: Path, defaults: Mapping[str, str]) -> Process:
    node = program.node
    stem = node.full_name.strip("/").replace("/", "-")
    log = logs / f"{stem}.log" if node.output == "log" else None
    command = command_line(program, plan, _parameter_file(plan, node, logs / f"{stem}.yaml"))
    if defaults.get("KBOT_TRANSPORT") == "local":
        command = [*command, *_parameter_words(plan, node)]
    return Process(
        name=node.full_name,
        command=command,
        environment={**defaults, **environment(program)},
        folder=_folder(node, program),
        log=log,
        respawn=node.respawn_delay if node.respawn else None,
        required=node.required,
        delay=node.delay,
        after=node.after,
        origin=node.origin,
    )


def _parameter_words(plan: Plan, node: PlannedNode) -> list[str]:
    """The parameters of a ROS 1 node as words of its command line, for a run without a parameter server."""
    if plan.is_ros_2:
        return []  # they are in its parameter file
    own = plan.params_of(node).items()
    return [f"_{name}:={param.value}" for name, param in own if not isinstance(param.value, list | bytes)]


def _folder(node: PlannedNode, program: Program) -> str:
    """The working folder: that of the program for `cwd="node"`, that of ROS for `ROS_HOME`, else the current
    one."""
    if node.cwd == "node":
        return str(Path(program.file).parent)
    if node.cwd in ("ROS_HOME", "ros-root", "ros_home"):
        home = Path(os.environ.get("ROS_HOME") or Path.home() / ".ros")
        home.mkdir(parents=True, exist_ok=True)
        return str(home)
    return str(Path.cwd())


def _parameter_file(plan: Plan, node: PlannedNode, path: Path) -> str:
    """Write a parameter file for a ROS 2 node. Empty for ROS 1, where the master has the parameters."""
    own = {name: param.value for name, param in plan.params_of(node).items()}
    if not plan.is_ros_2 or not own:
        return ""
    import yaml  # imported lazily: only ROS 2 nodes with parameters need it

    path.write_text(yaml.safe_dump({node.full_name: {"ros__parameters": own}}), encoding="utf-8")
    return str(path)
