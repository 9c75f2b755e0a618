"""Finds the robots that a launch spawns, one for each spawner, with their names, frames and controllers."""

from __future__ import annotations

import re
from collections.abc import Iterable, Sequence
from dataclasses import replace
from pathlib import Path

from kbot.model.spawned import SpawnedController
from kbot.ros.launch.absent_packages import absent_package
from kbot.ros.launch.known_packages import Role, role
from kbot.ros.launch.node_arguments import place_of_value
from kbot.ros.launch.node_settings.gazebo import GazeboSettings
from kbot.ros.launch.node_settings.spawning import SpawnedRobot, SpawnRequest, is_sdf, read_spawn, spawned
from kbot.ros.launch.plan import Param, Plan, PlannedNode, RobotDescription
from kbot.text import DescriptionError, Diagnostic, Severity, read_source

_LINK = re.compile(r"<link\s+name\s*=\s*[\"']([^\"']+)")


def read_population(
    plan: Plan, spawners: Sequence[PlannedNode], controllers: Iterable[SpawnedController]
) -> tuple[list[SpawnedRobot], list[SpawnedRobot], list[Diagnostic]]:
    """The robots of a launch, its SDF models, and findings about its spawners.

    Without a spawner, the robot is that of the first parameter with a description, if any.
    """
    notes: list[Diagnostic] = []
    robots: list[SpawnedRobot] = []
    models: list[SpawnedRobot] = []
    unmatched: list[PlannedNode] = []
    for node in spawners:
        spawn, found = read_spawn(node)
        notes += found
        if node.type == "create" and len(spawners) > 1 and not spawn.namespace:
            # gz names topics after the model, or as the description does, and does not have namespaces
            spawn = replace(spawn, namespace=node.namespace.strip("/") or spawn.model)
        description = _description_of(spawned(plan, node))
        if description is None:
            unmatched.append(node)
        elif any(spawn.model == other.spawn.model for other in (*robots, *models)):
            notes.append(_name_taken(node, spawn))
        elif absent_package(description.path) is not None:
            notes.append(_file_missing(node, description.path))
        elif is_sdf(node, description.path):
            models.append(SpawnedRobot(description.path, {}, spawn, node.origin))
        else:
            robots.append(_robot(plan, node, description, spawn))
    if not robots:
        robots = _first(plan, unmatched[:1])
        unmatched = unmatched[len(robots) :]
        twin = next((m for m in models if robots and _is_robot(m, plan)), None)
        if twin is not None:
            robots = [replace(robots[0], spawn=twin.spawn, origin=twin.origin)]
            models.remove(twin)
            notes.append(_replaced_by_description(twin, robots[0]))
    if robots or not _sdf_parameters(plan):
        notes += [_no_robot(node) for node in unmatched]
    if len(robots) > 1:
        robots = [_distinct(robot, number, notes) for number, robot in enumerate(robots)]
        notes += _shared_topics(robots)
    return _with_controllers(robots, controllers), models, notes


def _robot(plan: Plan, node: PlannedNode, description: RobotDescription, spawn: SpawnRequest) -> SpawnedRobot:
    prefix = _frame_prefix(plan, node, spawn.namespace)
    return SpawnedRobot(description.path, description.arguments, spawn, node.origin, prefix)


def _first(plan: Plan, spawners: Sequence[PlannedNode]) -> list[SpawnedRobot]:
    """The robot of the launch's parameters, for a launch in which no spawner names one."""
    described = {name: param for name, param in plan.params.items() if param.description}
    param = described.get("/robot_description") or next(iter(described.values()), None)
    description = _description_of(param)
    if param is None or description is None:
        return []
    for node in spawners:
        return [_robot(plan, node, description, read_spawn(node)[0])]
    return [SpawnedRobot(description.path, description.arguments, SpawnRequest(), param.origin)]


def _is_robot(model: SpawnedRobot, plan: Plan) -> bool:
    """Whether an SDF model is the robot of a parameter: more than half of its links have the same names."""
    texts = (str(param.value) for param in plan.params.values() if param.description)
    described = {name for text in texts for name in _LINK.findall(text)}
    try:
        own = set(_LINK.findall(read_source(model.path).text))
    except DescriptionError:
        return False
    return 2 * len(own & described) > len(own)


def _replaced_by_description(model: SpawnedRobot, robot: SpawnedRobot) -> Diagnostic:
    sdf, description = Path(model.path).name, Path(robot.path).name
    message = f"{sdf} is the same robot as {description}: KBot simulates {description} in its place"
    hint = "its sensors and plugins are those of the description, not of the SDF file"
    return Diagnostic("L063", Severity.INFO, message, model.origin, hint)


def _description_of(source: Param | RobotDescription | None) -> RobotDescription | None:
    return source.description if isinstance(source, Param) else source


def _frame_prefix(plan: Plan, spawner: PlannedNode, namespace: str) -> str:
    """The prefix of a robot's frames: `frame_prefix` of its robot_state_publisher (ROS 2), otherwise
    `tf_prefix` of its namespace (ROS 1), otherwise empty."""
    below = {f"/{namespace}/" if namespace else "/", spawner.namespace}
    for node in plan.nodes:
        if role(node.package, node.type) is Role.ROBOT_STATE and node.namespace in below:
            param = plan.params.get(f"{node.full_name}/frame_prefix")
            if param is not None:
                return str(param.value)
    for above in sorted(below, key=len, reverse=True):
        param = plan.params.get(f"{above}tf_prefix")
        if param is not None and str(param.value).strip("/"):
            return f"{str(param.value).strip('/')}/"
    return ""


def _distinct(robot: SpawnedRobot, number: int, notes: list[Diagnostic]) -> SpawnedRobot:
    """One of several robots, with a name and a frame prefix that distinguish it from the others."""
    spawn = robot.spawn
    prefix = robot.frame_prefix or (f"{spawn.namespace}/" if spawn.namespace else "")
    if not prefix and number:
        prefix = f"{spawn.model or f'robot_{number + 1}'}/"
    if not spawn.model and number:
        spawn = replace(spawn, model=f"robot_{number + 1}")
    if number and spawn.joints:
        message = (
            f"-J of {spawn.model} has no effect: only the first robot can start with joints that are not at 0"
        )
        notes.append(Diagnostic("L063", Severity.WARNING, message, robot.origin))
    return replace(robot, spawn=spawn, frame_prefix=prefix)


def _shared_topics(robots: Sequence[SpawnedRobot]) -> list[Diagnostic]:
    notes = []
    seen: dict[str, SpawnedRobot] = {}
    for robot in robots:
        other = seen.setdefault(robot.spawn.namespace, robot)
        if other is not robot:
            where = f"/{robot.spawn.namespace}".rstrip("/")
            message = f"'{robot.spawn.model}' and '{other.spawn.model}' share their topics: {where}/cmd_vel"
            message += " drives both"
            hint = f'give one of them a namespace: <group ns="{robot.spawn.model}">, or -robot_namespace'
            notes.append(Diagnostic("L063", Severity.WARNING, message, robot.origin, hint))
    return notes


def _with_controllers(
    robots: Sequence[SpawnedRobot], controllers: Iterable[SpawnedController]
) -> list[SpawnedRobot]:
    """The robots with their controllers. A controller belongs to the robot with its namespace, otherwise to
    the first robot."""
    own: dict[int, list[SpawnedController]] = {}
    for controller in controllers:
        fitting = (
            number
            for number, robot in enumerate(robots)
            if robot.spawn.namespace and controller.name.startswith(f"/{robot.spawn.namespace}/")
        )
        own.setdefault(next(fitting, 0), []).append(controller)
    return [replace(r, controllers=tuple(own.get(number, ()))) for number, r in enumerate(robots)]


def _name_taken(node: PlannedNode, spawn: SpawnRequest) -> Diagnostic:
    message = f"{node.full_name} spawns nothing: another spawner already uses the name '{spawn.model}'"
    hint = "give each model its own name: -model NAME"
    return Diagnostic("L062", Severity.WARNING, message, node.origin, hint)


def _file_missing(node: PlannedNode, path: str) -> Diagnostic:
    message = f"{path} does not exist: {node.full_name} spawns nothing"
    return Diagnostic("L012", Severity.ERROR, message, place_of_value(node, "-file"), "install the package")


def without_robot(plan: Plan, gazebo: GazeboSettings) -> list[Diagnostic]:
    """Why a launch that describes or simulates something has no robot."""
    notes = [
        Diagnostic(
            "L063",
            Severity.ERROR,
            f"{name} is an SDF model, which KBot does not run as a robot",
            param.origin,
            "use a URDF or xacro file of the robot",
        )
        for name, param in _sdf_parameters(plan).items()
    ]
    if gazebo.origin is not None and not notes:
        message = f"the world {gazebo.world} is not simulated: no node spawns a robot"
        hint = "spawn a robot from a URDF or xacro file. Models of the world have no effect as robots"
        notes.append(Diagnostic("L063", Severity.WARNING, message, gazebo.origin, hint))
    return notes


def _sdf_parameters(plan: Plan) -> dict[str, Param]:
    """The parameters that contain an SDF model."""
    return {n: p for n, p in plan.params.items() if isinstance(p.value, str) and "<sdf" in p.value}


def _no_robot(node: PlannedNode) -> Diagnostic:
    message = f"{node.full_name} spawns nothing: it does not name a robot of this launch file"
    hint = "add -param NAME, where NAME is a parameter that contains a robot, or -file FILE"
    return Diagnostic("L062", Severity.WARNING, message, node.origin, hint)
