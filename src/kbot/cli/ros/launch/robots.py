"""Puts the robots and things of a launch into its simulation, where its spawners say."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import TYPE_CHECKING

from kbot.kinematics.transform import Transform
from kbot.model.spawned import with_controllers
from kbot.text import DescriptionError, KbotError

if TYPE_CHECKING:
    from kbot.ros.launch.node_settings.spawning import SpawnedRobot, SpawnRequest
    from kbot.ros.launch.staging import Stage
    from kbot.sim import Simulation


def put_all(simulation: Simulation, staged: Stage, package_path: Sequence[str]) -> None:
    """The first robot is there already; its joints, height and attitude are those of its spawner.

    Raises:
        DescriptionError, KbotError: one cannot be used, or cannot stand there.
    """
    _put(simulation, staged.spawn)
    for other in staged.others:
        _spawn(simulation, other, package_path)
    for model in staged.models:
        _spawn_thing(simulation, model)


def _spawn(simulation: Simulation, other: SpawnedRobot, package_path: Sequence[str]) -> None:
    from kbot.model.load import load_robot  # most launches have one robot
    from kbot.xacro import Packages

    packages, spawn = Packages(package_path, around=other.path), other.spawn
    robot = load_robot(other.path, other.arguments, packages=packages).require()
    try:
        spawned = simulation.models.spawn_model(
            with_controllers(robot, other.controllers),
            spawn.model,
            spawn.x,
            spawn.y,
            spawn.yaw,
            namespace=spawn.namespace,
            frame_prefix=other.frame_prefix,
        )
    except DescriptionError:
        raise
    except KbotError as error:
        raise KbotError(f"{other.origin}: {error}") from None
    _put(simulation, replace(spawn, joints={}), spawned.name)


def _spawn_thing(simulation: Simulation, model: SpawnedRobot) -> None:
    spawn = model.spawn
    place = Transform.from_xyz_rpy((spawn.x, spawn.y, spawn.z or 0.0), (spawn.roll, spawn.pitch, spawn.yaw))
    try:
        simulation.models.spawn_sdf(model.path, spawn.model or None, place)
    except DescriptionError:
        raise
    except KbotError as error:
        raise KbotError(f"{model.origin}: {error}") from None


def _put(simulation: Simulation, spawn: SpawnRequest, name: str | None = None) -> None:
    """The joints that were given, and the height and attitude, where the ground does not say them."""
    if spawn.joints:
        simulation.models.place(simulation.start, spawn.joints)
    robot = simulation.robots.named(name)
    name, standing = robot.name, robot.body.link_pose(robot.robot.root)
    x, y, height = standing.translation.tolist()
    lift = max(0.0, (spawn.z or 0.0) - height)
    if lift > 0.0 or spawn.roll or spawn.pitch:
        pose = Transform.from_xyz_rpy((x, y, height + lift), (spawn.roll, spawn.pitch, standing.yaw))
        simulation.models.set_model_state(name, pose)
