"""The actuators that move a holonomic base: two forces along its plane and a torque about its vertical axis.

The rollers of mecanum and omni wheels are not modelled. Instead, the wheels slide freely, and a servo of the
base's planar velocity applies the force that the ground would apply through them. The force is at most what
the wheels can hold by friction, and what their motors can exert. A wall stops the base, and in the air
nothing moves it.
"""

from __future__ import annotations

from math import inf
from typing import NamedTuple

import mujoco

from kbot.kinematics.bodies import center_of_mass
from kbot.kinematics.drive.declared import Holonomic
from kbot.kinematics.drive.drive import HolonomicDrive
from kbot.kinematics.frames import FrameTree
from kbot.model import RobotModel
from kbot.sim.engine.geometry import wxyz
from kbot.sim.engine.surfaces import DEFAULT_SURFACE, link_surfaces
from kbot.sim.recipe import FRICTION
from kbot.text import DiagnosticCollector

AXES = (":x", ":y", ":yaw")
"""The ends of the names of the actuators: forces along x and y, and the torque about z."""
_GEARS = ((1.0, 0.0, 0.0, 0.0, 0.0, 0.0), (0.0, 1.0, 0.0, 0.0, 0.0, 0.0), (0.0, 0.0, 0.0, 0.0, 0.0, 1.0))

_STRONG = (inf, inf, inf)
"""The motors of a plugin that has no limit of force."""


class Traction(NamedTuple):
    """What limits the force on a holonomic base.

    friction  coefficient of friction between the wheels and the ground
    lever     metres by which the largest force is multiplied for the largest torque
    motors    the largest forces (N) and torque (N m) of the wheels' motors
    """

    friction: float
    lever: float
    motors: tuple[float, float, float]


def traction(robot: RobotModel, drive: HolonomicDrive) -> Traction:
    """What limits the force on a base.

    A plugin that moves the base itself usually needs wheels without friction, which is not that of a tyre.
    Such a base gets the default friction.
    """
    lever = drive.separation / 2.0
    if drive.kind is Holonomic.BODY:
        return Traction(FRICTION, lever, _STRONG)
    surfaces = link_surfaces(robot, DiagnosticCollector())
    friction = min(surfaces.get(link, DEFAULT_SURFACE).friction for link in drive.tyres)
    if drive.kind is Holonomic.TRACKS:
        return Traction(friction, lever, _STRONG)
    efforts = {joint: robot.joints[joint].effort_limit for joint in drive.joints}
    x, y, yaw = (
        sum(
            efforts[joint] * abs(direction[axis])
            for joint, direction in drive.directions.items()
            if direction[axis]
        )
        / drive.radius
        for axis in range(3)
    )
    return Traction(friction, lever, (x, y, yaw * lever))


def add_base_servo(spec: mujoco.MjSpec, robot: RobotModel, drive: HolonomicDrive, prefix: str) -> None:
    """Add the actuators. They are commanded in m/s and rad/s, in the frame of the drive.

    Wheels push the base at the ground. A plugin pushes it at its centre of mass.
    """
    x, y, z = drive.axle_in_base.translation.tolist()
    height = z - drive.radius
    if drive.kind is Holonomic.BODY:
        tree = FrameTree(robot)
        center = center_of_mass(tree)
        if center is not None:
            height = float(tree.pose(robot.root, in_frame=drive.base).apply(center)[2])
    site = spec.body(prefix + drive.base).add_site(
        name=prefix, pos=(x, y, height), quat=wxyz(drive.axle_in_base)
    )
    for name, gear in zip(AXES, _GEARS, strict=True):
        servo = spec.add_actuator(name=prefix + name, target=site.name)
        servo.trntype = mujoco.mjtTrn.mjTRN_SITE
        servo.gear = gear
        # `HolonomicServos` sets the gain, from the mass that it moves, and the limits, from the load
        servo.set_to_velocity(kv=1.0)
        servo.forcelimited = True
        servo.forcerange = (-1.0, 1.0)
