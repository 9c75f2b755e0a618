"""Detects whether a robot touches anything except the ground."""

from __future__ import annotations

import math

import mujoco
import numpy as np
from numpy.typing import NDArray

from kbot.kinematics.drive.drive import DifferentialDrive
from kbot.sim.engine.geometry import own_geometries
from kbot.sim.engine.placing import lowest_point
from kbot.sim.engine.world_builder import PREFIX, owner
from kbot.sim.robots import Robots
from kbot.world.ground import STEP

_UPRIGHT = math.cos(math.radians(45.0))
"""Smallest z component of a ground surface's normal. With a friction coefficient of about 1, a tyre holds a
robot on slopes of up to 45 degrees."""

_SINKS = 0.001
"""Most metres by which a wheel sinks into the ground in a stiff contact."""

_OWN, _FLOOR, _OTHER = 1, 3, 8
"""Kinds of shapes. The sum of two kinds identifies the pair."""
_SUSPECT = _OWN + _OTHER


class Collisions:
    """Finds what a simulation's first robot touches except the ground.

    Ground is a surface under the robot, within 45 degrees of level: a plane, a height field, or another shape
    that the robot touches below its axles. A fixed shape whose top is at most 1.2 cm above the robot's lowest
    point is ground too, because maps mark such an edge as free. Contacts of the robot's links with each other
    do not count. Contacts with other robots always count.
    """

    def __init__(self, robots: Robots) -> None:
        self._robots = robots
        self._model: mujoco.MjModel | None = None
        self._harmless = b""
        self.link = ""
        """The link of the robot that touched what `touched` found last."""

    def touched(self, model: mujoco.MjModel, data: mujoco.MjData) -> str:
        """The name of an object or robot that the robot touches, or an empty string."""
        if model is not self._model:
            self._bind(model, data)
        pairs = data.contact.geom
        key = pairs.tobytes()
        if key == self._harmless:
            return ""
        suspects = np.flatnonzero(self._kinds[pairs].sum(axis=1) == _SUSPECT)
        if not len(suspects):
            self._harmless = key
        for at in suspects.tolist():
            contact = data.contact[at]
            if not self._is_ground(data, contact):
                own, other = sorted(contact.geom.tolist(), key=lambda geom: self._kinds[geom] != _OWN)
                link: str = model.body(model.geom_bodyid[own]).name
                self.link = link.removeprefix(self._robots.first.body.prefix)
                return _name(owner(model, other))
        return ""

    def is_touching(self, model: mujoco.MjModel, data: mujoco.MjData) -> bool:
        """Whether the robot touches anything, also the ground."""
        if model is not self._model:
            self._bind(model, data)
        return bool((self._kinds[data.contact.geom] == _OWN).any())

    def _bind(self, model: mujoco.MjModel, data: mujoco.MjData) -> None:
        """Look up the shapes in a model. The model changes when robots are spawned or deleted."""
        robots, robot = self._robots, self._robots.first
        self._model, self._harmless = model, b""
        self._own = own_geometries(model, robot.name)
        self._is_robot = np.zeros(model.ngeom, dtype=bool)
        for name in robots:
            self._is_robot[own_geometries(model, name)] = True
        is_fixed = model.body_weldid[model.geom_bodyid] == 0
        is_plane = model.geom_type == mujoco.mjtGeom.mjGEOM_PLANE
        self._is_endless = is_plane | (model.geom_type == mujoco.mjtGeom.mjGEOM_HFIELD)
        upward = data.geom_xmat[:, 6:9]
        self._kinds = np.where(is_plane & (upward[:, 2] >= _UPRIGHT), _FLOOR, _OTHER)
        self._kinds[self._own] = _OWN
        middles, halves = model.geom_aabb[:, :3], model.geom_aabb[:, 3:]
        tops = data.geom_xpos[:, 2] + (upward * middles + abs(upward) * halves).sum(axis=1)
        self._tops = np.where(is_fixed & ~self._is_endless, tops, math.inf)
        self._base = robot.body.index(robot.base)
        # a robot without wheels cannot have goals: nothing counts as below its axle
        drive = robot.drive
        self._axle = drive.axle_in_base.translation[2] if isinstance(drive, DifferentialDrive) else -math.inf

    def _is_ground(self, data: mujoco.MjData, contact: mujoco.MjContact) -> bool:
        """Whether a contact is with the ground, or with an edge that the robot drives over."""
        other, up = int(contact.geom[0]), float(contact.frame[2])
        if self._kinds[other] == _OWN:
            other, up = int(contact.geom[1]), -up
        if self._is_robot[other]:
            return False
        if self._is_endless[other]:
            # if a shape barely touches a height field, the engine's normal may point down
            return abs(up) >= _UPRIGHT
        if up >= _UPRIGHT and self._height(data, contact.pos) < self._axle:
            return True
        lowest = lowest_point(self._model, data, self._own)
        return lowest is not None and bool(self._tops[other] <= lowest + STEP + _SINKS)

    def _height(self, data: mujoco.MjData, point: NDArray[np.float64]) -> float:
        """Height in m of a point above the base's origin, along the base's z axis."""
        return float(data.xmat[self._base].reshape(3, 3)[:, 2] @ (point - data.xpos[self._base]))


def _name(body: str) -> str:
    """The name of the object, or of the robot, whose `owner` is given."""
    return body.removeprefix(PREFIX) if body.startswith(PREFIX) else body.partition("/")[0]
