"""The pose of a robot on a plane, and its integration from the distances that the wheels rolled.

Source of the formulas: a constant twist over a step is a motion along an arc, the exponential of se(2) (Lynch
and Park, Modern Robotics, 13.4). The result is exact for steps of any length.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TypeVar

import numpy as np
from numpy.typing import NDArray

from kbot.kinematics.angles import wrap

Array = NDArray[np.float64]
_Coordinate = TypeVar("_Coordinate", float, Array)


@dataclass(frozen=True, slots=True)
class PlanarPose:
    """A position and a heading. The yaw of poses that are combined is wrapped: above -pi and at most pi.

    x    position in m
    y    position in m
    yaw  heading in rad
    """

    x: float = 0.0
    y: float = 0.0
    yaw: float = 0.0

    def __matmul__(self, other: PlanarPose) -> PlanarPose:
        """`a_from_c = a_from_b @ b_from_c`."""
        c, s = math.cos(self.yaw), math.sin(self.yaw)
        return PlanarPose(
            self.x + c * other.x - s * other.y, self.y + s * other.x + c * other.y, wrap(self.yaw + other.yaw)
        )

    def inverse(self) -> PlanarPose:
        c, s = math.cos(self.yaw), math.sin(self.yaw)
        return PlanarPose(-c * self.x - s * self.y, s * self.x - c * self.y, wrap(-self.yaw))

    def apply(self, points: Array) -> Array:
        """Points (n, 2) in m from this pose's frame to the outer frame."""
        c, s = math.cos(self.yaw), math.sin(self.yaw)
        placed: Array = points @ np.array([[c, s], [-s, c]]) + (self.x, self.y)
        return placed

    def local(self, x: _Coordinate, y: _Coordinate) -> tuple[_Coordinate, _Coordinate]:
        """A point in m from the outer frame to this pose's frame; for many points, x and y are arrays."""
        c, s = math.cos(self.yaw), math.sin(self.yaw)
        dx, dy = x - self.x, y - self.y
        return c * dx + s * dy, c * dy - s * dx


@dataclass(frozen=True, slots=True)
class PlanarTwist:
    """Forward and leftward speed in m/s and turning speed in rad/s, in the moving frame."""

    x: float = 0.0
    y: float = 0.0
    yaw: float = 0.0


def arc(length: float, turn: float) -> PlanarPose:
    """Motion along an arc of `length` metres that turns by `turn` radians and begins along x."""
    half = turn / 2.0
    # sin(half)/half, from its series for small angles, where the quotient loses digits
    sinc = math.sin(half) / half if abs(half) > 1e-4 else 1.0 - half * half / 6.0
    chord = length * sinc
    return PlanarPose(chord * math.cos(half), chord * math.sin(half), turn)


def integrate(
    pose: PlanarPose,
    left: float,
    right: float,
    separation: float,
    axle_in_base: PlanarPose = PlanarPose(),
) -> PlanarPose:
    """The base's pose after its left and right wheels rolled `left` and `right` metres.

    `separation` is the distance in m between the contact points of the wheels. `axle_in_base` is the middle
    of the axle, about which the robot turns, in the base's frame. The result is exact for constant wheel
    speeds. Its yaw is wrapped."""
    step = arc((left + right) / 2.0, (right - left) / separation)
    return pose @ axle_in_base @ step @ axle_in_base.inverse()
