"""What a plan comes to without ROS: which robot is shown or simulated where, and what cannot be run."""

from __future__ import annotations

import shlex
from collections.abc import Mapping
from dataclasses import dataclass

from kbot.launch.known import Role, role
from kbot.launch.plan import Included, Node, Param, Plan
from kbot.text import Diagnostic, Severity

_POSE_OPTIONS = ("-x", "-y", "-z", "-R", "-P", "-Y")


@dataclass(frozen=True)
class Stage:
    """The robot file and its xacro arguments, whether it is simulated and in which world.

    `path` is None where no parameter holds a robot; `notes` say what is not done and why.
    """

    path: str | None
    arguments: Mapping[str, str]
    simulate: bool
    world: str
    notes: tuple[Diagnostic, ...]


def stage(plan: Plan) -> Stage:
    """What stands in for a plan's nodes, and a note for each that nothing stands in for."""
    notes = [*_unknown_nodes(plan)]
    spawners = [n for n in plan.nodes if role(n.package, n.type) is Role.SPAWNER]
    robot = _robot(plan, spawners)
    for node in spawners:
        given = [word for word in _words(node) if word in _POSE_OPTIONS]
        if given:
            message = f"{', '.join(given)}: the robot starts at the origin"
            notes.append(Diagnostic("L059", Severity.WARNING, message, node.spans["args"]))
    description = robot.description if robot else None
    if robot is None or description is None:
        return Stage(None, {}, bool(spawners), _world(plan.included), tuple(notes))
    return Stage(description.path, description.arguments, bool(spawners), _world(plan.included), tuple(notes))


def _robot(plan: Plan, spawners: list[Node]) -> Param | None:
    """The description that is spawned, else the first that there is."""
    described = {name: param for name, param in plan.params.items() if param.description}
    for node in spawners:
        words = _words(node)
        if "-param" in words[:-1]:
            name = words[words.index("-param") + 1]
            for full in (name, f"{node.namespace}{name}", f"/{name}"):
                if full in described:
                    return described[full]
    return described.get("/robot_description") or next(iter(described.values()), None)


def _words(node: Node) -> list[str]:
    try:
        return shlex.split(node.args)
    except ValueError:
        return []


def _world(included: tuple[Included, ...]) -> str:
    """The world that Gazebo would load, as the launch file names it."""
    for launch in included:
        if launch.package == "gazebo_ros":
            given = launch.arguments.get("world_name") or launch.arguments.get("world")
            return given or launch.name.replace("_world.launch", ".world")
    return "empty"


def _unknown_nodes(plan: Plan) -> list[Diagnostic]:
    notes = []
    for node in plan.nodes:
        if role(node.package, node.type) is not None:
            continue
        severity = Severity.ERROR if node.required else Severity.WARNING
        message = f"nothing stands in for the node {node.package}/{node.type}: {node.full_name} is not run"
        hint = "the launch needs it (required)" if node.required else "it runs where a ROS is installed"
        notes.append(Diagnostic("L055", severity, message, node.spans["type"], hint))
    return notes
