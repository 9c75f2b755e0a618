"""Reads the settings of spawn_model, spawn_entity.py and create: which robot is spawned, and where."""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass, field

from kbot.model.spawned import SpawnedController
from kbot.ros.launch.known_packages import SPAWN_MODEL_VALUES
from kbot.ros.launch.node_arguments import Options, number, place_of, read_options
from kbot.ros.launch.plan import Param, Plan, PlannedNode, RobotDescription
from kbot.text import Diagnostic, Origin, Severity

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
    """Where a robot starts in the world: m and rad. `z` is None where it is put on the ground. `model` is
    what it is called, empty for its own name; its topics are in the `namespace`, as `a/b`, or at the root."""

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
    """A robot file with its xacro arguments, where it is put, and what stands before its frames."""

    path: str
    arguments: Mapping[str, str]
    spawn: SpawnRequest
    origin: Origin
    frame_prefix: str = ""
    controllers: tuple[SpawnedController, ...] = ()


def read_spawn(node: PlannedNode) -> tuple[SpawnRequest, list[Diagnostic]]:
    """What a spawner's arguments ask for, and what of it is not done."""
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
        ("-database", "there is no database of models"),
        ("-package_to_model", "nothing is rewritten"),
    ):
        if options.has(option):
            options.notes.append(_partly(node, option, why))
    frame = options.text("-reference_frame") or ""
    if frame not in _WORLD_FRAMES:
        options.notes.append(_partly(node, "-reference_frame", "the pose is taken in the world"))
    return spawn, options.notes


def spawned(plan: Plan, node: PlannedNode) -> Param | RobotDescription | None:
    """The description that a spawner names: a parameter that is set, or a file."""
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
    if topic:  # the topic of robot_state_publisher, whose parameter has its name
        return next((p for full, p in described.items() if full.endswith(f"/{name}")), None)
    return None


def is_sdf(node: PlannedNode, path: str) -> bool:
    """Whether what a spawner names is a model of SDF, and no robot of URDF."""
    return path.endswith(".sdf") or (_options(node).has("-sdf") and not path.endswith((".urdf", ".xacro")))


def _namespace(node: PlannedNode, options: Options) -> str:
    """Plugins of Gazebo for ROS are in the spawner's own namespace, unless it is told another; gz knows of
    none."""
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


def _partly(node: PlannedNode, option: str, why: str) -> Diagnostic:
    return Diagnostic("L063", Severity.WARNING, f"{option}: {why}", place_of(node, option))
