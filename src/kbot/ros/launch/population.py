"""The robots that a launch spawns: one for each spawner, with names, frames and controllers."""

from __future__ import annotations

import re
from collections.abc import Iterable, Sequence
from dataclasses import replace
from pathlib import Path

from kbot.model.spawned import SpawnedController
from kbot.ros.launch.known_packages import Role, role
from kbot.ros.launch.node_settings.spawning import SpawnedRobot, SpawnRequest, is_sdf, read_spawn, spawned
from kbot.ros.launch.plan import Param, Plan, PlannedNode, RobotDescription
from kbot.text import DescriptionError, Diagnostic, Severity, read_source

_LINK = re.compile(r"<link\s+name\s*=\s*[\"']([^\"']+)")


def read_population(
    plan: Plan, spawners: Sequence[PlannedNode], controllers: Iterable[SpawnedController]
) -> tuple[list[SpawnedRobot], list[SpawnedRobot], list[Diagnostic]]:
    """The robots of a launch, the first being the one that is shown where nothing is spawned, none where no
    parameter holds a robot; models of SDF; and what is wrong with spawners."""
    notes: list[Diagnostic] = []
    robots: list[SpawnedRobot] = []
    models: list[SpawnedRobot] = []
    strangers: list[PlannedNode] = []
    for node in spawners:
        spawn, found = read_spawn(node)
        notes += found
        if node.type == "create" and len(spawners) > 1 and not spawn.namespace:
            # gz itself names topics by the model, or as the description says
            spawn = replace(spawn, namespace=node.namespace.strip("/") or spawn.model)
        description = _described(spawned(plan, node))
        if description is None:
            strangers.append(node)
        elif any(spawn.model == other.spawn.model for other in (*robots, *models)):
            notes.append(_taken(node, spawn))
        elif is_sdf(node, description.path):
            models.append(SpawnedRobot(description.path, {}, spawn, node.origin))
        else:
            robots.append(_robot(plan, node, description, spawn))
    notes += [_no_robot(node) for node in strangers[not robots :]]
    if not robots:
        robots = _first(plan, strangers[:1])
        twin = next((m for m in models if robots and _is_robot(m, plan)), None)
        if twin is not None:
            robots = [replace(robots[0], spawn=twin.spawn, origin=twin.origin)]
            models.remove(twin)
            notes.append(_in_its_place(twin, robots[0]))
    if len(robots) > 1:
        robots = [_apart(robot, number, notes) for number, robot in enumerate(robots)]
        notes += _shared(robots)
    return _with_controllers(robots, controllers), models, notes


def _robot(plan: Plan, node: PlannedNode, description: RobotDescription, spawn: SpawnRequest) -> SpawnedRobot:
    prefix = _frame_prefix(plan, node, spawn.namespace)
    return SpawnedRobot(description.path, description.arguments, spawn, node.origin, prefix)


def _first(plan: Plan, spawners: Sequence[PlannedNode]) -> list[SpawnedRobot]:
    """The robot that the launch's parameters hold, where no spawner names one."""
    described = {name: param for name, param in plan.params.items() if param.description}
    param = described.get("/robot_description") or next(iter(described.values()), None)
    description = _described(param)
    if param is None or description is None:
        return []
    for node in spawners:
        return [_robot(plan, node, description, read_spawn(node)[0])]
    return [SpawnedRobot(description.path, description.arguments, SpawnRequest(), param.origin)]


def _is_robot(model: SpawnedRobot, plan: Plan) -> bool:
    """Whether a model of SDF is the robot that a parameter describes: most links are of the same names."""
    texts = (str(param.value) for param in plan.params.values() if param.description)
    described = {name for text in texts for name in _LINK.findall(text)}
    try:
        own = set(_LINK.findall(read_source(model.path).text))
    except DescriptionError:
        return False
    return 2 * len(own & described) > len(own)


def _in_its_place(model: SpawnedRobot, robot: SpawnedRobot) -> Diagnostic:
    message = (
        f"{Path(model.path).name} is the robot that {Path(robot.path).name} describes, which is simulated"
    )
    hint = "in its place: its sensors and plugins are those of the description"
    return Diagnostic("L063", Severity.INFO, message, model.origin, hint)


def _described(found: Param | RobotDescription | None) -> RobotDescription | None:
    return found.description if isinstance(found, Param) else found


def _frame_prefix(plan: Plan, spawner: PlannedNode, namespace: str) -> str:
    """What robot_state_publisher is told to put before frames: `tf_prefix` of ROS 1, which holds for all in a
    namespace, `frame_prefix` of ROS 2."""
    below = {f"/{namespace}/" if namespace else "/", spawner.namespace}
    for node in plan.nodes:
        if role(node.package, node.type) is Role.ROBOT_STATE and node.namespace in below:
            told = plan.params.get(f"{node.full_name}/frame_prefix")
            if told is not None:
                return str(told.value)
    for above in sorted(below, key=len, reverse=True):
        told = plan.params.get(f"{above}tf_prefix")
        if told is not None and str(told.value).strip("/"):
            return f"{str(told.value).strip('/')}/"
    return ""


def _apart(robot: SpawnedRobot, number: int, notes: list[Diagnostic]) -> SpawnedRobot:
    """One of several: told apart by namespace, and its frames by what stands before them."""
    spawn = robot.spawn
    prefix = robot.frame_prefix or (f"{spawn.namespace}/" if spawn.namespace else "")
    if not prefix and number:
        prefix = f"{spawn.model or f'robot_{number + 1}'}/"
    if not spawn.model and number:
        spawn = replace(spawn, model=f"robot_{number + 1}")
    if number and spawn.joints:
        message = f"-J: only the first robot starts with joints elsewhere than at 0, not {spawn.model}"
        notes.append(Diagnostic("L063", Severity.WARNING, message, robot.origin))
    return replace(robot, spawn=spawn, frame_prefix=prefix)


def _shared(robots: Sequence[SpawnedRobot]) -> list[Diagnostic]:
    notes = []
    seen: dict[str, SpawnedRobot] = {}
    for robot in robots:
        other = seen.setdefault(robot.spawn.namespace, robot)
        if other is not robot:
            where = f"/{robot.spawn.namespace}".rstrip("/")
            message = f"'{robot.spawn.model}' shares its topics with '{other.spawn.model}': {where}/cmd_vel"
            message += " drives both"
            hint = f'give it a namespace: <group ns="{robot.spawn.model}">, or -robot_namespace'
            notes.append(Diagnostic("L063", Severity.WARNING, message, robot.origin, hint))
    return notes


def _with_controllers(
    robots: Sequence[SpawnedRobot], controllers: Iterable[SpawnedController]
) -> list[SpawnedRobot]:
    """Each controller belongs to the robot whose namespace it is in, else to the first."""
    own: dict[int, list[SpawnedController]] = {}
    for controller in controllers:
        fitting = (
            number
            for number, robot in enumerate(robots)
            if robot.spawn.namespace and controller.name.startswith(f"/{robot.spawn.namespace}/")
        )
        own.setdefault(next(fitting, 0), []).append(controller)
    return [replace(r, controllers=tuple(own.get(number, ()))) for number, r in enumerate(robots)]


def _taken(node: PlannedNode, spawn: SpawnRequest) -> Diagnostic:
    message = f"{node.full_name} spawns no further '{spawn.model}': the world has a model of that name"
    hint = "each model has a name of its own: -model NAME"
    return Diagnostic("L062", Severity.WARNING, message, node.origin, hint)


def _no_robot(node: PlannedNode) -> Diagnostic:
    message = f"{node.full_name} spawns nothing: it names no robot that this launch sets"
    hint = "-param NAME of a parameter that xacro fills, or -file FILE"
    return Diagnostic("L062", Severity.WARNING, message, node.origin, hint)
