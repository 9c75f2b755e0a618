"""Forces on a robot: where it rests, how much its tyres push and its other parts drag, what loads its joints,
and when it tips over."""

from __future__ import annotations

from collections.abc import Collection, Iterator, Mapping
from dataclasses import dataclass
from math import acos, hypot, inf

import mujoco
import numpy as np
from numpy.typing import NDArray

from kbot.kinematics.bodies import center_of_mass
from kbot.kinematics.drive.drive import DifferentialDrive, HolonomicDrive
from kbot.kinematics.drive.wheels import links_on_ground
from kbot.kinematics.frames import FrameTree
from kbot.kinematics.planar import convex_hull, twice_area
from kbot.kinematics.spatial import GRAVITY
from kbot.model import Capsule, Cylinder, Sphere
from kbot.sim.engine.base_servo import traction
from kbot.sim.engine.geometry import own_geometries
from kbot.sim.robot import SimulatedRobot

CREEP = 0.2
"""Slip of tyres that hold, for a drag that is as strong as they are.

As measured, a fixed caster of friction 0.3 and 1, which drags with 0.13 and 0.42 of what the tyres can push,
takes 2 and 7 % from turns. Straight ahead it takes a third of that.
"""
_MEAN = 0.1
"""Seconds over which contact forces are averaged."""
_FLAT = 0.7
"""Least vertical component of the ground's normal: it rises by up to 45 degrees, and walls are steeper."""


@dataclass(frozen=True, slots=True)
class GroundContact:
    """A contact of a robot's `link` with a fixed shape below it.

    depth   how deep the link is in the shape, in m
    normal  of the ground (3,), upwards
    """

    link: str
    depth: float
    normal: NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class Grip:
    """The friction of a robot's contacts with the ground, as accelerations of its mass in m/s^2.

    push    the most that all driving tyres can exert
    drag    what all other parts exert against the motion; in a turn multiplied by their lever, as a share of
            the lever of the tyres
    parts   the links that drag, the strongest first
    pushes  the push of each driving tyre, as a share of the mean of all of them
    """

    push: float
    drag: float
    parts: tuple[str, ...]
    pushes: Mapping[str, float]

    def creep(self, drag: float) -> float:
        """The share by which tyres that hold slip because something drags (m/s^2)."""
        return min(1.0, CREEP * drag / self.push) if self.push > 0.0 else 1.0

    def missing(self, needed: float) -> float:
        """The share of an acceleration (m/s^2) that the tyres cannot give the robot: 0 to 1."""
        return min(1.0, max(0.0, 1.0 - (self.push - self.drag) / needed))


def ground_contacts(
    model: mujoco.MjModel, data: mujoco.MjData, robot: SimulatedRobot
) -> Iterator[GroundContact]:
    """The contacts of a robot with the ground, now."""
    own = own_geometries(model, robot.name)
    mine, normals = set(own.tolist()), data.contact.frame[:, :3]
    is_own = np.isin(data.contact.geom, own).any(axis=1)
    for index in np.flatnonzero(is_own & (np.abs(normals[:, 2]) > _FLAT)).tolist():
        pair, normal = data.contact.geom[index].tolist(), normals[index]
        for geom, other in (pair, pair[::-1]):
            if geom in mine and model.body_weldid[model.geom_bodyid[other]] == 0:
                depth = -float(data.contact.dist[index])
                yield GroundContact(_link_of(model, geom), depth, normal * np.sign(normal[2]))


def ground_below(
    model: mujoco.MjModel, data: mujoco.MjData, robot: SimulatedRobot
) -> tuple[list[str], NDArray[np.float64]]:
    """The links that rest on the ground, without those that roll, and the mean normal of the ground (3,)."""
    rolling = robot.drive.carriers if isinstance(robot.drive, DifferentialDrive) else ()
    contacts = list(ground_contacts(model, data, robot))
    # without a contact the ground is taken to be level
    normal = sum((contact.normal for contact in contacts), np.array([0.0, 0.0, 1e-9]))
    resting = [contact.link for contact in contacts if contact.link not in rolling]
    return resting, normal / np.linalg.norm(normal)


def angle_between(a: NDArray[np.float64], b: NDArray[np.float64]) -> float:
    """The angle in rad between two unit vectors (3,)."""
    return acos(min(1.0, max(-1.0, float(a @ b))))


def joint_loads(
    model: mujoco.MjModel, data: mujoco.MjData, robot: SimulatedRobot, positions: Mapping[str, float]
) -> dict[str, float]:
    """The magnitudes in N m or N of the efforts that hold joints at these positions (rad or m) against the
    robot's weight."""
    still = mujoco.MjData(model)
    still.qpos[:] = data.qpos
    joints = {name: model.joint(robot.body.prefix + name) for name in positions}
    for name, joint in joints.items():
        still.qpos[joint.qposadr] = positions[name]
    mujoco.mj_forward(model, still)
    return {name: abs(float(still.qfrc_bias[joint.dofadr[0]])) for name, joint in joints.items()}


def mass_of(model: mujoco.MjModel, robot: SimulatedRobot) -> float:
    """The mass of a robot in kg."""
    return float(model.body_subtreemass[robot.body.index(robot.robot.root)])


def _link_of(model: mujoco.MjModel, geom: int) -> str:
    """The link of a robot's geometry."""
    return str(model.body(int(model.geom_bodyid[geom])).name).partition("/")[2]


def grip(model: mujoco.MjModel, data: mujoco.MjData, robot: SimulatedRobot, *, in_turn: bool) -> Grip:
    """The friction of a robot's contacts now: the mean of the next `_MEAN` seconds, because slipping wheels
    hop."""
    drive = robot.drive
    tyres: Collection[str] = drive.tyres if isinstance(drive, DifferentialDrive) else ()
    mass = mass_of(model, robot)
    mine = set(own_geometries(model, robot.name).tolist())
    middle, half = robot.body.link_pose(robot.base).translation, inf
    # the wheels of a holonomic base slide freely, and its servo pushes it with their friction
    of_servo = traction(robot.robot, drive).friction if isinstance(drive, HolonomicDrive) else None
    if isinstance(drive, DifferentialDrive):
        middle = (robot.body.link_pose(drive.base) @ drive.axle_in_base).translation
        half = drive.separation / 2.0
    steps = max(1, round(_MEAN / model.opt.timestep))
    trial, force = mujoco.MjData(model), np.zeros(6)
    mujoco.mj_copyData(trial, model, data)
    drags, pushes = dict[str, float](), dict.fromkeys(tyres, 0.0)
    for _ in range(steps):
        mujoco.mj_step(model, trial)
        for index, contact in enumerate(trial.contact):
            first, second = contact.geom.tolist()
            if (first in mine) is (second in mine) or abs(float(contact.frame[2])) <= _FLAT:
                continue  # a contact between two of its own parts, or with a wall
            mujoco.mj_contactForce(model, trial, index, force)
            link = _link_of(model, first if first in mine else second)
            load = float(force[0]) / mass / steps
            # a contact of one dimension has no friction
            friction = float(contact.friction[0]) * load if contact.dim > 1 else 0.0
            if link in pushes:
                pushes[link] += friction if of_servo is None else of_servo * load
            else:
                lever = hypot(*(contact.pos - middle)[:2].tolist()) / half if in_turn else 1.0
                drags[link] = drags.get(link, 0.0) + friction * lever
    parts = sorted((link for link in drags if drags[link] > 0.0), key=lambda link: -drags[link])
    push = sum(pushes.values())
    shares = {link: own * len(pushes) / push if push else 1.0 for link, own in pushes.items()}
    return Grip(push, sum(drags.values()), tuple(parts), shares)


def tipping(robot: SimulatedRobot) -> tuple[float, float]:
    """When a robot on level ground begins to tip, and how far its centre of mass is from its axle's middle.

    The first is the least acceleration in m/s^2: g x (distance of the centre of mass to the nearest edge of
    its support) / (its height), as in D115. It is negative if the centre is not above the support, and
    infinite if the support is unknown. The second is a distance in m along the ground: in a turn of w rad/s
    the centre is accelerated by w^2 times as much.
    """
    drive = robot.drive
    if not isinstance(drive, DifferentialDrive):
        return inf, 0.0
    tree = FrameTree(robot.robot)
    centre = center_of_mass(tree, drive.base)
    carriers = links_on_ground(tree, drive.base)
    # a plate or a mesh has other contact points than its middle
    if (
        centre is None
        or not carriers
        or not all(isinstance(c.shape, Cylinder | Sphere | Capsule) for c in carriers)
    ):
        return inf, 0.0
    points = [(float(c.center[0]), float(c.center[1])) for c in carriers]
    points += [(float(w.center[0]), float(w.center[1])) for w in drive.wheels.values()]
    hull = convex_hull([(round(x, 9), round(y, 9)) for x, y in points], tolerance=1e-12)
    off = float(np.linalg.norm((centre - drive.axle_in_base.translation)[:2]))
    height = float(centre[2]) - min(carrier.bottom for carrier in carriers)
    if height <= 0.0:
        return inf, 0.0
    if len(hull) < 3:
        return 0.0, off  # two wheels alone balance
    at = float(centre[0]), float(centre[1])
    margin = min(
        twice_area(a, b, at) / hypot(b[0] - a[0], b[1] - a[1])
        for a, b in zip(hull, [*hull[1:], hull[0]], strict=True)
    )
    return GRAVITY * margin / height, off
