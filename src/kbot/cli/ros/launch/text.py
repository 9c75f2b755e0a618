"""The text that `kbot launch` prints: the table of nodes, and lists in the format of roslaunch."""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import click

from kbot.ros.launch import Plan, PlannedNode
from kbot.ros.launch.known_packages import Role, role
from kbot.ros.launch.node_settings.spawning import SpawnedRobot
from kbot.text import KbotError
from kbot.text.columns import aligned
from kbot.text.suggest import did_you_mean

if TYPE_CHECKING:
    from kbot.ros.launch.staging import Stage

_OF_SIMULATION = (Role.SIMULATOR, Role.CONTROLLER, Role.BRIDGE)
"""What KBot runs only with a simulation."""


def table(plan: Plan, stage: Stage) -> str:
    """A line for each node: its name, its program, what KBot does for it, and its line in the launch file."""
    rows = [
        (n.full_name, f"{n.package}/{n.type}", _action(n, stage), _place(str(n.origin))) for n in plan.nodes
    ]
    simulator = _replacement(Role.SIMULATOR, stage)
    rows += [
        (f"{i.namespace}gazebo", f"{i.package}/{i.name}", simulator, _place(str(i.origin)))
        for i in plan.included
    ]
    lines = [f"  {line}" for line in aligned(rows, left=range(4))]
    robots = [_robot(robot) for robot in stage.robots] or ["  no robot"]
    return "\n".join(
        [
            f"{plan.path}: {_count(len(plan.params), 'parameter')}, {_count(len(rows), 'node')}",
            *lines,
            *robots,
        ]
    )


def _robot(robot: SpawnedRobot) -> str:
    given = "".join(f" {name}:={value}" for name, value in robot.arguments.items())
    namespace = robot.spawn.namespace
    return f"  robot: {robot.path}{given}" + (f"  in /{namespace}" if namespace else "")


def _action(node: PlannedNode, stage: Stage) -> str:
    if node.is_test:
        return "a test, not run"
    found = role(node.package, node.type, node.args)
    if found is not None:
        return _replacement(found, stage)
    is_running = any(program.node.full_name == node.full_name for program in stage.programs)
    return "run as a program" if is_running else "not run"


def _replacement(found: Role, stage: Stage) -> str:
    is_run = stage.is_simulated or found not in _OF_SIMULATION
    return found if is_run else "not run: no node spawns a robot"


def _place(origin: str) -> str:
    file, line, _ = origin.rsplit(":", 2)
    return f"{Path(file).name}:{line}"


@dataclass(frozen=True, slots=True)
class Questions:
    """What to print instead of running a launch file. `args_of` is the node whose command line to print."""

    nodes: bool
    files: bool
    dump_params: bool
    ros_args: bool
    args_of: str | None

    def __bool__(self) -> bool:
        return self.nodes or self.files or self.dump_params or self.ros_args or bool(self.args_of)


def print_answers(plan: Plan, questions: Questions) -> None:
    """Print what `questions` select.

    Raises:
        KbotError: there is no node `args_of`.
    """
    if questions.nodes:
        for node in plan.nodes:
            click.echo(node.full_name)
    if questions.files:
        for file in dict.fromkeys(plan.files):
            click.echo(file)
    if questions.dump_params:
        import yaml  # only for --dump-params

        click.echo(yaml.safe_dump({name: param.value for name, param in plan.params.items()}))
    if questions.ros_args:
        click.echo(_arguments(plan))
    if questions.args_of:
        click.echo(_command_line(plan, questions.args_of))


def _arguments(plan: Plan) -> str:
    """The launch file's arguments, as `roslaunch --ros-args` prints them."""
    if not plan.arguments:
        return "No arguments."
    lines = []
    for title, wanted in (("Required Arguments:", False), ("Optional Arguments:", True)):
        some = [a for name, a in sorted(plan.arguments.items()) if bool(a.default) is wanted]
        if some:
            lines.append(title)
        for argument in some:
            default = f' (default "{argument.default}")' if wanted else ""
            lines.append(f"  {argument.name}{default}: {argument.doc or 'undocumented'}")
    return "\n".join(lines)


def _command_line(plan: Plan, name: str) -> str:
    by_name = {node.full_name: node for node in plan.nodes}
    node = by_name.get(name) or by_name.get("/" + name)
    if node is None:
        hint = did_you_mean(name, by_name) or f"the nodes are {', '.join(by_name)}"
        raise KbotError(f"there is no node {name}: {hint}")
    remaps: Mapping[str, str] = dict(node.remaps)
    environment = [f'{key}="{value}"' for key, value in node.env]
    words = [node.launch_prefix or "", f"{node.package}/{node.type}", re.sub(r"\s+", " ", node.args.strip())]
    words += [*(f"{source}:={target}" for source, target in remaps.items()), f"__name:={node.name}"]
    return " ".join([*environment, *(word for word in words if word)])


def _count(number: int, what: str) -> str:
    return f"{number} {what}{'' if number == 1 else 's'}"
