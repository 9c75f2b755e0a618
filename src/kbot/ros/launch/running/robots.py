"""Spawns the robots and models of a launch in its simulation."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import TYPE_CHECKING

from kbot.kinematics.transform import Transform
from kbot.model import Pose, RobotModel
from kbot.model.spawned import with_controllers
from kbot.ros.launch.node_settings.spawning import SpawnedRobot, SpawnRequest
from kbot.ros.launch.staging import Stage
from kbot.text import DescriptionError, Diagnostic, KbotError
from kbot.xacro import Packages

if TYPE_CHECKING:
    from kbot.sim import Simulation

_WORLD = "world"
"""The root link of a robot that is fixed to the world."""


def spawn_all(simulation: Simulation, stage: Stage, package_path: Sequence[str]) -> tuple[Diagnostic, ...]:
    """Spawn all models, and all robots except the first, which is already in the simulation. The first robot
    gets the joint positions, the height and the attitude of its spawner. Return the warnings about the start
    poses, at the lines of the spawners, and about models.

    Raises:
        DescriptionError, KbotError: a robot or model cannot be used, or another object is in its place.
    """
    from kbot.sim.start_findings import START_CODES  # imported lazily, because it loads the engine

    first, *others = stage.robots
    starts = [_at_spawner(d, first) for d in simulation.diagnostics if d.code in START_CODES]
    _place(simulation, first.spawn)
    for robot in others:
        before = len(simulation.diagnostics)
        _spawn_robot(simulation, robot, package_path)
        starts += [_at_spawner(d, robot) for d in simulation.diagnostics[before:] if d.code in START_CODES]
    robots_only = len(simulation.diagnostics)
    for model in stage.models:
        _spawn_model(simulation, model)
    if stage.models:  # one of them may be the ground
        starts = [d for d in starts if d.code != "W115"]
    return (*starts, *simulation.diagnostics[robots_only:])


def _at_spawner(finding: Diagnostic, spawned: SpawnedRobot) -> Diagnostic:
    """A finding about a start pose. If it has no line of the world, it gets that of the spawner."""
    if finding.origin is not None:
        return finding
    return replace(finding, origin=spawned.origin, hint="change the x and y with which it is spawned")


def as_spawned(robot: RobotModel, spawned: SpawnedRobot) -> RobotModel:
    """The robot with its spawned controllers. What is joined to its root `world` gets the height and the
    attitude of the spawner: as in Gazebo, the joint keeps the robot where it is spawned."""
    robot, spawn = with_controllers(robot, spawned.controllers), spawned.spawn
    if robot.root != _WORLD:
        return robot
    world_from_spawn = Transform.from_xyz_rpy((0.0, 0.0, spawn.z or 0.0), (spawn.roll, spawn.pitch, 0.0))
    joints = dict(robot.joints)
    for joint in robot.child_joints[_WORLD]:
        pose = world_from_spawn @ Transform.of(joint.pose)
        x, y, z = pose.translation.tolist()
        joints[joint.name] = replace(joint, pose=Pose((x, y, z), pose.rpy, joint.pose.origin))
    return replace(robot, joints=joints)


def _spawn_robot(simulation: Simulation, spawned: SpawnedRobot, package_path: Sequence[str]) -> None:
    from kbot.model.load import load_robot  # imported lazily: most launches have one robot

    packages, spawn = Packages(package_path, around=spawned.path), spawned.spawn
    robot = load_robot(spawned.path, spawned.arguments, packages=packages).require()
    try:
        simulated = simulation.models.spawn_model(
            as_spawned(robot, spawned),
            spawn.model,
            spawn.x,
            spawn.y,
            spawn.yaw,
            namespace=spawn.namespace,
            frame_prefix=spawned.frame_prefix,
        )
    except DescriptionError:
        raise
    except KbotError as error:
        raise KbotError(f"{spawned.origin}: {error}") from None
    _place(simulation, replace(spawn, joints={}), simulated.name)


def _spawn_model(simulation: Simulation, model: SpawnedRobot) -> None:
    spawn = model.spawn
    place = Transform.from_xyz_rpy((spawn.x, spawn.y, spawn.z or 0.0), (spawn.roll, spawn.pitch, spawn.yaw))
    try:
        simulation.models.spawn_sdf(model.path, spawn.model or None, place)
    except DescriptionError:
        raise
    except KbotError as error:
        raise KbotError(f"{model.origin}: {error}") from None


def _place(simulation: Simulation, spawn: SpawnRequest, name: str | None = None) -> None:
    """Set the joint positions, and the height and attitude if they differ from those of a robot on the
    ground."""
    if spawn.joints:
        simulation.models.place(simulation.start, spawn.joints)
    robot = simulation.robots.named(name)
    if robot.body.root_qpos < 0:
        return  # fixed to the world
    name, standing = robot.name, robot.body.link_pose(robot.robot.root)
    x, y, height = standing.translation.tolist()
    lift = max(0.0, (spawn.z or 0.0) - height)
    if lift > 0.0 or spawn.roll or spawn.pitch:
        pose = Transform.from_xyz_rpy((x, y, height + lift), (spawn.roll, spawn.pitch, standing.yaw))
        simulation.models.set_model_state(name, pose)
