"""Reads the settings of spawn_model, spawn_entity.py and create: the robot to spawn, and its pose."""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass, field

from kbot.model.spawned import SpawnedController
from kbot.ros.launch.known_packages import SPAWN_MODEL_VALUES
from kbot.ros.launch.node_arguments import Options, number, place_of, read_options
from kbot.ros.launch.plan import Param, Plan, PlannedNode, RobotDescription
from kbot.text import Diagnostic, Origin, Severity
from kbot.text.file_kind import ROBOT, WORLD, kind_of_file

_CREATE_VALUES: Mapping[str, int] = {
    **dict.fromkeys(("-world", "-param", "-file", "-string", "-topic", "-name"), 1),
    **dict.fromkeys(("-x", "-y", "-z", "-R", "-P", "-Y"), 1),
    "-allow_renaming": 1,
}
_SPAWN_ENTITY_VALUES: Mapping[str, int] = {
    **SPAWN_MODEL_VALUES,
    **dict.fromkeys(("-entity", "-topic", "-timeout", "-spawn_service_timeout"), 1),
}
_NAME_OPTIONS = ("-model", "-entity", "-name")
_WORLD_FRAMES = ("", "world", "map", "odom")


@dataclass(frozen=True, slots=True)
class SpawnRequest:
    """How a robot is spawned.

    x, y, z           position in the world in m; without `z` the robot is put on the ground
    roll, pitch, yaw  attitude in rad
    joints            joint positions in rad or m
    unpause           whether the simulation continues after spawning
    model             the name of the model; empty for the name in the description
    namespace         the namespace of its topics without outer slashes, for example `a/b`
    """

    x: float = 0.0
    y: float = 0.0
    z: float | None = None
    roll: float = 0.0
    pitch: float = 0.0
    yaw: float = 0.0
    joints: Mapping[str, float] = field(default_factory=dict)
    unpause: bool = False
    model: str = ""
    namespace: str = ""


@dataclass(frozen=True, slots=True)
class SpawnedRobot:
    """A robot file with its xacro arguments, its spawn request, and the prefix of its frames."""

    path: str
    arguments: Mapping[str, str]
    spawn: SpawnRequest
    origin: Origin
    frame_prefix: str = ""
    controllers: tuple[SpawnedController, ...] = ()


def read_spawn(node: PlannedNode) -> tuple[SpawnRequest, list[Diagnostic]]:
    """The request in a spawner's arguments, and a note for each option that has no effect."""
    options = _options(node)
    spawn = SpawnRequest(
        x=options.number("-x"),
        y=options.number("-y"),
        z=options.number("-z") if options.has("-z") else None,
        roll=options.number("-R"),
        pitch=options.number("-P"),
        yaw=options.number("-Y"),
        joints=_joints(options),
        unpause=options.has("-unpause"),
        model=re.sub(r"\W", "_", options.text(*_NAME_OPTIONS) or ""),
        namespace=_namespace(node, options),
    )
    for option, why in (
        ("-database", "KBot does not have a model database"),
        ("-package_to_model", "KBot does not rewrite package:// to model://"),
    ):
        if options.has(option):
            options.notes.append(_no_effect(node, option, why))
    frame = options.text("-reference_frame") or ""
    if frame not in _WORLD_FRAMES:
        options.notes.append(_no_effect(node, "-reference_frame", "the pose is in the world frame"))
    return spawn, options.notes


def spawned(plan: Plan, node: PlannedNode) -> Param | RobotDescription | None:
    """The description that a spawner names, as a parameter or a file. None if it does not exist."""
    options = _options(node)
    file = options.text("-file")
    if file:
        return RobotDescription(file, {})
    described = {name: param for name, param in plan.params.items() if param.description}
    topic = options.text("-topic")
    name = options.text("-param") or (topic and topic.rpartition("/")[2])
    if not name:
        return None
    for full in (name, f"{node.namespace}{name}", f"/{name}"):
        if full in described:
            return described[full]
    if topic:  # robot_state_publisher publishes its parameter on a topic of the same name
        return next((p for full, p in described.items() if full.endswith(f"/{name}")), None)
    return None


def is_sdf(node: PlannedNode, path: str) -> bool:
    """Whether a spawner names an SDF model and not a URDF robot."""
    kind = kind_of_file(path)
    return kind == WORLD or (kind != ROBOT and _options(node).has("-sdf"))


def _namespace(node: PlannedNode, options: Options) -> str:
    """The namespace of a robot's topics: that of `-robot_namespace`, otherwise that of the spawner. gz does
    not have namespaces."""
    given = options.text("-robot_namespace") if options.has("-robot_namespace") else None
    if given is None and node.type == "create":
        return ""
    return (node.namespace if given is None else given).strip("/")


def _options(node: PlannedNode) -> Options:
    values = {"create": _CREATE_VALUES, "spawn_model": SPAWN_MODEL_VALUES}.get(
        node.type, _SPAWN_ENTITY_VALUES
    )
    return read_options(node, values)


def _joints(options: Options) -> dict[str, float]:
    words = options.given.get("-J", ())
    pairs = zip(words[::2], words[1::2], strict=False)
    notes = options.notes
    return {joint: number(options.node, word, f"-J {joint}", 0.0, notes) for joint, word in pairs}


def _no_effect(node: PlannedNode, option: str, why: str) -> Diagnostic:
    return Diagnostic("L063", Severity.WARNING, f"{option} has no effect: {why}", place_of(node, option))
