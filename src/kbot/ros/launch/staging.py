"""Decides how KBot runs a plan: its robots, their start poses, and what replaces each node."""

from __future__ import annotations

from dataclasses import dataclass, replace
from datetime import datetime
from typing import TypeVar

from kbot.ros.launch.absent_packages import readable
from kbot.ros.launch.known_packages import NODES, RENAMED, Role, role
from kbot.ros.launch.node_settings.gazebo import GazeboSettings, read_gazebo
from kbot.ros.launch.node_settings.gz_bridge import read_bridged
from kbot.ros.launch.node_settings.joint_states import read_joint_states
from kbot.ros.launch.node_settings.map_server import read_maps
from kbot.ros.launch.node_settings.rosbag_play import read_playing
from kbot.ros.launch.node_settings.rosbag_record import RecordRequest, read_recording
from kbot.ros.launch.node_settings.rviz import ViewerSettings, read_viewer
from kbot.ros.launch.node_settings.spawner import read_controllers, runs_hardware
from kbot.ros.launch.node_settings.spawning import SpawnedRobot
from kbot.ros.launch.node_settings.static_transforms import read_static_transform
from kbot.ros.launch.node_settings.teleop import read_keys
from kbot.ros.launch.node_settings.topic_tools import read_muxes, read_relays
from kbot.ros.launch.plan import Plan, PlannedNode
from kbot.ros.launch.population import read_population, without_robot
from kbot.ros.launch.user_program import Program, find_program
from kbot.ros.nodes.gz_bridge import Bridged
from kbot.ros.nodes.joint_state_publisher import JointStateSettings
from kbot.ros.nodes.playing import Playing
from kbot.ros.nodes.relays import Relayed
from kbot.ros.nodes.teleop_twist_keyboard import Keys
from kbot.ros.nodes.twist_mux import MuxSettings
from kbot.text import Diagnostic, Severity
from kbot.tf.static_transforms import StaticTransform
from kbot.xacro.packages import Packages

_T = TypeVar("_T")


@dataclass(frozen=True)
class StandInSettings:
    """The settings of the nodes that KBot replaces beside a robot, or without one.

    maps        map.yaml files that a map server publishes
    recordings  what rosbag records
    playings    recordings that are played back
    keys        the settings of teleop_twist_keyboard; None if the launch does not have it
    bridged     topics that a bridge to gz renames
    relayed     topics that are republished under another name
    muxes       the settings of each twist_mux
    """

    transforms: tuple[StaticTransform, ...] = ()
    maps: tuple[str, ...] = ()
    recordings: tuple[RecordRequest, ...] = ()
    playings: tuple[Playing, ...] = ()
    keys: Keys | None = None
    bridged: tuple[Bridged, ...] = ()
    relayed: tuple[Relayed, ...] = ()
    muxes: tuple[MuxSettings, ...] = ()

    @property
    def has_publishers(self) -> bool:
        """Whether any of them publishes without a robot."""
        return bool(self.playings or self.transforms or self.maps or self.keys)


@dataclass(frozen=True)
class Stage:
    """What KBot does in place of a launch's nodes.

    robots        the first is the one that is shown or driven; empty if no parameter holds a robot
    models        SDF models that are spawned
    is_simulated  whether the robots are simulated: the launch has a spawner or ros2_control_node
    gazebo        the world, and whether the simulation starts paused
    viewer        the settings of rviz; None if the launch does not have it
    joints        the settings of joint_state_publisher
    programs      the user's own nodes that can run
    notes         nodes that are not run and settings that have no effect, with the reason
    """

    robots: tuple[SpawnedRobot, ...]
    models: tuple[SpawnedRobot, ...]
    is_simulated: bool
    gazebo: GazeboSettings
    viewer: ViewerSettings | None
    joints: JointStateSettings
    stand_ins: StandInSettings
    programs: tuple[Program, ...]
    notes: tuple[Diagnostic, ...]

    @property
    def robot(self) -> SpawnedRobot | None:
        """The first robot."""
        return self.robots[0] if self.robots else None

    @property
    def has_window(self) -> bool:
        """Whether the launch opens a window of Gazebo or rviz."""
        return self.gazebo.window or self.viewer is not None


def stage(plan: Plan, packages: Packages | None = None) -> Stage:
    """The robots and replaced nodes of a plan, with a note for each node that KBot neither replaces nor runs.
    Like roslaunch, KBot does not run tests."""
    packages = packages or Packages(around=plan.path)
    plan = replace(plan, nodes=tuple(node for node in plan.nodes if not node.is_test))
    cast: dict[Role | None, list[PlannedNode]] = {}
    for node in plan.nodes:
        cast.setdefault(role(node.package, node.type, node.args), []).append(node)
    notes: list[Diagnostic] = []

    def noted(read: tuple[_T, list[Diagnostic]]) -> _T:
        notes.extend(read[1])
        return read[0]

    programs = noted(_programs(cast.get(None, []), packages))
    spawners = cast.get(Role.SPAWNER, [])
    transforms = [noted(read_static_transform(node)) for node in cast.get(Role.TRANSFORM, [])]
    now = datetime.now()
    recordings = [noted(read_recording(node, now)) for node in cast.get(Role.RECORDER, [])]
    is_simulated = bool(spawners) or any(runs_hardware(node) for node in plan.nodes)
    found = [noted(read_playing(node, can_pause=is_simulated)) for node in cast.get(Role.PLAYER, [])]
    playings = tuple(playing for playing in found if playing is not None)
    gazebo = noted(read_gazebo(plan))
    joints = noted(read_joint_states(plan))
    controllers = noted(read_controllers(plan, cast.get(Role.CONTROLLER, [])))
    keys = noted(read_keys(plan, cast.get(Role.TELEOP, [])))
    notes += [_gamepad(node) for node in cast.get(Role.GAMEPAD, [])[:1]]
    bridged = noted(read_bridged(plan, cast.get(Role.BRIDGE, [])))
    relayed = noted(read_relays(plan, cast.get(Role.RELAY, [])))
    muxes = noted(read_muxes(plan, cast.get(Role.MUX, [])))
    robots, models, of_robots = read_population(plan, spawners, controllers)
    notes += of_robots if robots else [*of_robots, *without_robot(plan, gazebo)]
    viewer = noted(read_viewer(cast.get(Role.VIEWER, [])))
    maps = noted(read_maps(plan, cast.get(Role.MAP, [])))
    is_unpaused = any(robot.spawn.unpause for robot in robots)
    is_paused = (gazebo.paused and not is_unpaused) or any(playing.paused for playing in playings)
    return Stage(
        tuple(robots),
        tuple(models),
        is_simulated,
        replace(gazebo, paused=is_paused),
        viewer,
        joints,
        StandInSettings(
            tuple(t for t in transforms if t is not None),
            maps,
            tuple(recordings),
            playings,
            keys,
            bridged,
            relayed,
            muxes,
        ),
        programs,
        tuple(replace(note, message=readable(note.message)) for note in notes),
    )


def _programs(nodes: list[PlannedNode], packages: Packages) -> tuple[tuple[Program, ...], list[Diagnostic]]:
    programs = []
    notes = []
    for node in nodes:
        if node.package in NODES or (node.package, node.type) in RENAMED or not node.package:
            notes.append(_unknown(node))
            continue
        found = find_program(node, packages)
        if isinstance(found, Program):
            programs.append(found)
        else:
            notes.append(found)
    return tuple(programs), notes


def _unknown(node: PlannedNode) -> Diagnostic:
    severity = Severity.ERROR if node.required else Severity.WARNING
    what = f"node {node.package}/{node.type}" if node.package else f"program {node.type}"
    message = f"{node.full_name} is not run: KBot cannot replace the {what}"
    hint = "run it with ROS"
    hint = f"{hint}; the node is required" if node.required else hint
    return Diagnostic("L055", severity, message, node.spans["type"], hint)


def _gamepad(node: PlannedNode) -> Diagnostic:
    message = f"node {node.package}/{node.type} is not run: the page reads gamepads"
    hint = "connect the gamepad to the machine that shows the page; its left stick drives the robot"
    return Diagnostic("L055", Severity.INFO, message, node.spans["type"], hint)
