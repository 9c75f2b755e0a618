"""The shape of a simulated robot as it is now: with its arms where they are, and with what it carries."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Mapping
from itertools import product

import mujoco
import numpy as np
from numpy.typing import NDArray

from kbot.kinematics.drive.drive import DifferentialDrive, SteeredDrive
from kbot.model import JointType
from kbot.navigation.space.footprint import RobotShape, robot_shape
from kbot.sim import Simulation
from kbot.sim.engine.welds import STATIC
from kbot.world import World

_MOVED = 0.02
"""rad or m. A joint that is nearer to zero counts as at zero: it sags under its load."""
_STEERED = (-1.0, -0.5, 0.5, 1.0)
"""Shares of the steering range at which a steered wheel takes space beside its straight position."""


def simulated_shape(simulation: Simulation) -> RobotShape:
    """The shape of a simulation's first robot in the frame of its base, with its arms at their current
    positions and everything that is attached to it.

    Wheels that steer take the space of all their directions.

    Raises:
        KbotError: the robot has no collision shape.
    """
    robot, drive = simulation.robots.first, simulation.robots.first.drive
    base = drive.base if isinstance(drive, DifferentialDrive) else robot.robot.root
    joints = _arms(simulation)
    boxes = list(robot_shape(robot.robot, base, joints).boxes)
    if isinstance(drive, SteeredDrive):
        for share in _STEERED:
            turned = {**joints, **_steered(simulation, drive, share)}
            boxes += robot_shape(robot.robot, base, turned).boxes
    base_from_world = simulation.link_pose(base).inverse()
    model, data = simulation.engine.current()
    for body in loads(simulation):
        for geom in range(model.ngeom):
            if model.geom_bodyid[geom] == body and (model.geom_contype[geom] or model.geom_conaffinity[geom]):
                boxes.append(base_from_world.apply(_box(model, data, geom)))
    return RobotShape(tuple(boxes))


def world_without_loads(simulation: Simulation) -> World:
    """The simulation's world without the objects that are attached to its first robot."""
    model = simulation.engine.current()[0]
    names = {model.body(body).name for body in loads(simulation)}
    world = simulation.world
    kept = tuple(body for body in world.bodies if body.name not in names)
    return world if len(kept) == len(world.bodies) else dataclasses.replace(world, bodies=kept)


def loads(simulation: Simulation) -> list[int]:
    """The engine's bodies that are attached to the first robot, also through each other."""
    robot = simulation.robots.first
    model, _ = simulation.engine.current()
    own = {model.body(robot.body.prefix + link).weldid[0] for link in robot.body.links}
    held = set[int]()
    welds = [
        tuple(int(model.body(name).weldid[0]) for name in (weld.first, weld.second))
        for weld in simulation.engine.assembly.welds
        if STATIC not in (weld.first, weld.second)
    ]
    for _ in welds:
        for first, second in (*welds, *(pair[::-1] for pair in welds)):
            if first in own | held and second not in own:
                held.add(second)
    return [body for body in range(model.nbody) if int(model.body_weldid[body]) in held]


def _arms(simulation: Simulation) -> dict[str, float]:
    """The positions of joints that are away from zero and do not drive, steer or roll."""
    robot = simulation.robots.first
    drive = robot.drive
    moving = set(drive.joints) if isinstance(drive, DifferentialDrive) else set[str]()
    if isinstance(drive, SteeredDrive):
        moving |= set(drive.steering)
    return {
        name: position
        for name, position in robot.body.joint_positions.items()
        if name not in moving
        and abs(position) > _MOVED
        and robot.robot.joints[name].type in (JointType.REVOLUTE, JointType.PRISMATIC)
        and robot.robot.joints[name].mimic is None
    }


def _steered(simulation: Simulation, drive: SteeredDrive, share: float) -> Mapping[str, float]:
    """The steering joints at a share of their range, at most a quarter of a turn to each side."""
    positions = {}
    for name in drive.steering:
        joint = simulation.robot.joints[name]
        if joint.mimic is None:
            lower, upper = (max(min(end, math.pi / 2.0), -math.pi / 2.0) for end in joint.range)
            positions[name] = -share * lower if share < 0.0 else share * upper
    return positions


def _box(model: mujoco.MjModel, data: mujoco.MjData, geom: int) -> NDArray[np.float64]:
    """The corners (8, 3) in m in the world of the box around one of the engine's shapes."""
    middle, half = model.geom_aabb[geom][:3], model.geom_aabb[geom][3:]
    corners = middle + np.array(list(product((-1.0, 1.0), repeat=3))) * half
    placed: NDArray[np.float64] = corners @ data.geom_xmat[geom].reshape(3, 3).T + data.geom_xpos[geom]
    return placed
