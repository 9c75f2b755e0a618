"""What a plan comes to without ROS: which robot is shown or simulated where, and what runs beside it."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, replace
from datetime import datetime
from pathlib import Path
from typing import TypeVar

from kbot.model.spawned import SpawnedController
from kbot.ros.launch.known_packages import NODES, RENAMED, Role, role
from kbot.ros.launch.node_arguments import place_of_value, split
from kbot.ros.launch.node_settings.gazebo import read_gazebo
from kbot.ros.launch.node_settings.gz_bridge import read_bridged
from kbot.ros.launch.node_settings.joint_states import read_joint_states
from kbot.ros.launch.node_settings.rosbag_play import read_playing
from kbot.ros.launch.node_settings.rosbag_record import RecordRequest, read_recording
from kbot.ros.launch.node_settings.spawner import read_controllers, runs_hardware
from kbot.ros.launch.node_settings.spawning import SpawnedRobot, SpawnRequest
from kbot.ros.launch.node_settings.static_transforms import read_static_transform
from kbot.ros.launch.node_settings.teleop import read_keys
from kbot.ros.launch.plan import Plan, PlannedNode
from kbot.ros.launch.population import read_population
from kbot.ros.launch.running.programs import Program, find_program
from kbot.ros.nodes.gz_bridge import Bridged
from kbot.ros.nodes.joint_state_publisher import JointStateSettings
from kbot.ros.nodes.rosbag_play import Playing
from kbot.ros.nodes.teleop_twist_keyboard import Keys
from kbot.text import Diagnostic, Severity
from kbot.text.installed import find_file
from kbot.text.suggest import did_you_mean
from kbot.tf.static_transforms import StaticTransform
from kbot.xacro.packages import Packages

_T = TypeVar("_T")


@dataclass(frozen=True)
class Stage:
    """What KBot does in the place of a launch's nodes.

    path, arguments  the robot file and its xacro arguments; None where no parameter holds a robot
    simulate         whether it is simulated, in `world`, from `spawn` on, `paused` at first: because it is
                     spawned, or its hardware is run
    window           whether the launch wants anything to be seen
    displays         the file that rviz is told to show, empty where it is told none
    fixed_frame      the frame that rviz is told to hold still, empty where it is told none
    frame_prefix     what stands before its frames, empty for nothing
    others           robots that are spawned after it
    models           things of SDF that are spawned
    joints           what a joint_state_publisher is told
    maps             map.yaml files that a map server publishes
    keys             what teleop_twist_keyboard is told; None without one
    playings         recordings that are said again
    controllers      those that are spawned for it
    bridged          topics under the names that a bridge to gz gives them
    programs         the user's own nodes that can be run
    notes            what is not done and why
    """

    path: str | None
    arguments: Mapping[str, str]
    simulate: bool
    world: str
    paused: bool
    window: bool
    displays: str
    fixed_frame: str
    spawn: SpawnRequest
    frame_prefix: str
    others: tuple[SpawnedRobot, ...]
    models: tuple[SpawnedRobot, ...]
    joints: JointStateSettings
    transforms: tuple[StaticTransform, ...]
    maps: tuple[str, ...]
    recordings: tuple[RecordRequest, ...]
    playings: tuple[Playing, ...]
    keys: Keys | None
    controllers: tuple[SpawnedController, ...]
    bridged: tuple[Bridged, ...]
    programs: tuple[Program, ...]
    notes: tuple[Diagnostic, ...]


def stage(plan: Plan, packages: Packages | None = None) -> Stage:
    """What stands in for a plan's nodes, and a note for each that nothing stands in for. Tests are left to
    rostest, as roslaunch leaves them."""
    packages = packages or Packages(around=plan.path)
    plan = replace(plan, nodes=tuple(node for node in plan.nodes if not node.is_test))
    cast: dict[Role | None, list[PlannedNode]] = {}
    for node in plan.nodes:
        cast.setdefault(role(node.package, node.type, node.args), []).append(node)
    notes: list[Diagnostic] = []
    programs = _programs(cast.get(None, []), packages, notes)
    spawners = cast.get(Role.SPAWNER, [])
    transforms = [_taken(read_static_transform(node), notes) for node in cast.get(Role.TRANSFORM, [])]
    now = datetime.now()
    recordings = [_taken(read_recording(node, now), notes) for node in cast.get(Role.RECORDER, [])]
    simulate = bool(spawners) or any(runs_hardware(node) for node in plan.nodes)
    playings = [_taken(read_playing(node, can_wait=simulate), notes) for node in cast.get(Role.PLAYER, [])]
    gazebo, found = read_gazebo(plan)
    notes += found
    joints, found = read_joint_states(plan)
    notes += found
    controllers, found = read_controllers(plan, cast.get(Role.CONTROLLER, []))
    notes += found
    keys, found = read_keys(plan, cast.get(Role.TELEOP, []))
    notes += found
    notes += [_gamepad(node) for node in cast.get(Role.GAMEPAD, [])[:1]]
    bridged, found = read_bridged(plan, cast.get(Role.BRIDGE, []))
    notes += found
    robots, models, found = read_population(plan, spawners, controllers)
    notes += found
    first = robots[0] if robots else None
    spawn = first.spawn if first else SpawnRequest()
    viewers = cast.get(Role.VIEWER, [])
    notes += missing_displays(viewers)
    displays = next((file for node in viewers if (file := display_config(node.args))), "")
    return Stage(
        path=first.path if first else None,
        arguments=first.arguments if first else {},
        simulate=simulate,
        world=gazebo.world,
        paused=(gazebo.paused and not any(robot.spawn.unpause for robot in robots))
        or any(playing is not None and playing.paused for playing in playings),
        window=gazebo.window or bool(viewers),
        displays=find_file(displays) or displays,
        fixed_frame=next((frame for node in viewers if (frame := fixed_frame(node.args))), ""),
        spawn=spawn,
        frame_prefix=first.frame_prefix if first else "",
        others=tuple(robots[1:]),
        models=tuple(models),
        joints=joints,
        transforms=tuple(t for t in transforms if t is not None),
        maps=tuple(_maps(plan, cast.get(Role.MAP, []), notes)),
        recordings=tuple(recordings),
        playings=tuple(playing for playing in playings if playing is not None),
        keys=keys,
        controllers=first.controllers if first else controllers,
        bridged=bridged,
        programs=tuple(programs),
        notes=tuple(notes),
    )


def display_config(arguments: str) -> str:
    """The file that rviz is told to show by `-d` or `--display-config`, empty where it is told none."""
    return _option(arguments, "-d", "--display-config")


def missing_displays(nodes: Iterable[PlannedNode]) -> list[Diagnostic]:
    """A warning for each rviz among the nodes that is told to show a file that is not there."""
    found = []
    for node in nodes:
        file = display_config(node.args) if role(node.package, node.type, node.args) is Role.VIEWER else ""
        if file and find_file(file) is None:
            option = "-d" if "-d" in node.args.split() else "--display-config"
            where = place_of_value(node, option)
            message = f"there is no file {file}: rviz shows its own displays"
            found.append(Diagnostic("L059", Severity.WARNING, message, where, _nearest_file(file)))
    return found


def _nearest_file(path: str) -> str:
    try:
        return did_you_mean(Path(path).name, [file.name for file in Path(path).parent.iterdir()])
    except OSError:
        return ""


def fixed_frame(arguments: str) -> str:
    """The frame that rviz is told to hold still by `-f` or `--fixed-frame`, empty where it is told none."""
    return _option(arguments, "-f", "--fixed-frame")


def _option(arguments: str, short: str, long: str) -> str:
    words = arguments.split()
    for at, word in enumerate(words):
        if word in (short, long) and at + 1 < len(words):
            return words[at + 1]
        if word.startswith(f"{long}="):
            return word.partition("=")[2]
    return ""


def _taken(read: tuple[_T, list[Diagnostic]], notes: list[Diagnostic]) -> _T:
    value, found = read
    notes += found
    return value


def _programs(nodes: list[PlannedNode], packages: Packages, notes: list[Diagnostic]) -> list[Program]:
    programs = []
    for node in nodes:
        if node.package in NODES or (node.package, node.type) in RENAMED or not node.package:
            notes.append(_unknown(node))
            continue
        found = find_program(node, packages)
        if isinstance(found, Program):
            programs.append(found)
        else:
            notes.append(found)
    return programs


def _unknown(node: PlannedNode) -> Diagnostic:
    severity = Severity.ERROR if node.required else Severity.WARNING
    what = f"node {node.package}/{node.type}" if node.package else f"program {node.type}"
    message = f"nothing stands in for the {what}: {node.full_name} is not run"
    hint = "it runs where a ROS is installed"
    hint = f"the launch needs it (required); {hint}" if node.required else hint
    return Diagnostic("L055", severity, message, node.spans["type"], hint)


def _gamepad(node: PlannedNode) -> Diagnostic:
    message = f"node {node.package}/{node.type} is not run: the page reads gamepads"
    hint = "connect the gamepad to the machine that shows the page; its left stick drives the robot"
    return Diagnostic("L055", Severity.INFO, message, node.spans["type"], hint)


def _maps(plan: Plan, servers: list[PlannedNode], notes: list[Diagnostic]) -> list[str]:
    """The map files of ROS 1's arguments and of ROS 2's parameter."""
    found = []
    for node in servers:
        param = plan.params.get(f"{node.full_name}/yaml_filename")
        words = [word for word in split(node) if ":=" not in word and not word.startswith("-")]
        path = str(param.value) if param is not None else (words[0] if words else "")
        if Path(path).is_file():
            found.append(path)
        else:
            what = f"the map {path} is not there" if path else "map_server is given no map"
            where = param.origin if param is not None else node.spans.get("args", node.origin)
            notes.append(Diagnostic("L059", Severity.ERROR, f"{what}: nothing is on /map", where))
    return found
