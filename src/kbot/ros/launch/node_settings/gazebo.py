"""Reads the settings of Gazebo: the world, and whether it starts paused and shows a window."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

from kbot.ros.launch.known_packages import Role, role
from kbot.ros.launch.node_arguments import split
from kbot.ros.launch.plan import Included, Plan, PlannedNode
from kbot.ros.launch.quoting import split_words
from kbot.text import Diagnostic, Origin, Severity

_WITH_VALUE = frozenset(
    ("--render-engine", "--physics-engine", "--record-path", "--playback", "--gui-config", "-z", "--levels")
)
"""Options of gz sim that a value follows."""
_NO_EFFECT: Mapping[str, str] = {
    "recording": "to record the run, use --record FILE",
    "respawn_gazebo": "the simulation does not exit by itself",
}


@dataclass(frozen=True, slots=True)
class GazeboSettings:
    """`world` is the name in the launch file, and `origin` the place of its Gazebo, None without one."""

    world: str = "empty"
    paused: bool = False
    window: bool = True
    origin: Origin | None = None


def read_gazebo(plan: Plan) -> tuple[GazeboSettings, list[Diagnostic]]:
    """The settings of the first Gazebo of a launch, and a note for each argument that has no effect."""
    notes: list[Diagnostic] = []
    for included in plan.included:
        notes += _notes(included)
    for included in plan.included:
        settings = _included(included)
        if settings is not None:
            return replace(settings, origin=included.origin), notes
    for node in plan.nodes:
        if role(node.package, node.type, node.args) is Role.SIMULATOR:
            return replace(_gz_process(node) or _server(node), origin=node.origin), notes
    return GazeboSettings(), notes


def _included(included: Included) -> GazeboSettings | None:
    given = included.arguments
    if included.package == "ros_gz_bridge":
        return None
    if included.package in ("ros_gz_sim", "ros_ign_gazebo"):
        words = given.get("gz_args") or given.get("ign_args")
        return _gz(words or given.get("world_sdf_file") or "", given)
    if included.package != "gazebo_ros" or included.name.startswith("gzclient"):
        return None
    world = given.get("world_name") or given.get("world") or included.name.replace("_world.launch", ".world")
    return GazeboSettings(
        world if not included.name.endswith(".py") or given.get("world") else "empty",
        paused=_is_on(given, "paused") or _is_on(given, "pause"),
        window=not (_is_on(given, "headless") or given.get("gui", "true").lower() in ("false", "0")),
    )


def _gz(words: str, given: Mapping[str, str]) -> GazeboSettings:
    """The settings of gz. It starts paused unless `-r` is given, and `-s` starts it without a window."""
    try:
        parts = split_words(words)
    except ValueError:
        parts = words.split()
    world, skip = "", False
    for word in parts:
        if skip:
            skip = False
        elif word in _WITH_VALUE or word == "-v":
            skip = word != "-v"
        elif not word.startswith("-") and not word.isdecimal():
            world = world or word
    runs = "-r" in parts or "world_sdf_file" in given
    return GazeboSettings(world or "empty", paused=not runs, window="-s" not in parts)


def _gz_process(node: PlannedNode) -> GazeboSettings | None:
    """The settings of the processes `gz sim …` and `ign gazebo …`. None for any other process."""
    _, _, words = node.args.partition(" ")
    return _gz(words, {}) if node.type in ("gz", "ign") and not node.package else None


def _server(node: PlannedNode) -> GazeboSettings:
    """The settings of gazebo or gzserver as a node. The world is one of its arguments."""
    words = split(node)
    worlds = [word for word in words if word.endswith((".world", ".sdf"))]
    world = worlds[0] if worlds else "empty"
    return GazeboSettings(world, paused="-u" in words or "--pause" in words)


def _notes(included: Included) -> list[Diagnostic]:
    return [
        Diagnostic("L063", Severity.INFO, f"{name} has no effect: {why}", included.origin)
        for name, why in _NO_EFFECT.items()
        if _is_on(included.arguments, name)
    ]


def _is_on(arguments: Mapping[str, str], name: str) -> bool:
    return arguments.get(name, "false").lower() in ("true", "1")
