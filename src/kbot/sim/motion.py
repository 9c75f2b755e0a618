"""Where a robot is and how it moves, on the plane."""

from __future__ import annotations

import math
from dataclasses import dataclass

from kbot.kinematics.differential_drive import DifferentialDrive
from kbot.kinematics.odometry import PlanarPose, PlanarTwist


@dataclass(frozen=True, slots=True)
class Motion:
    """`pose` in the fixed frame (its yaw counts full turns), `twist` in the moving one."""

    pose: PlanarPose
    twist: PlanarTwist


class WheelOdometry:
    """Reckons the pose of the axle from wheel angles, by exact arcs, with no object made on the way."""

    def __init__(self, drive: DifferentialDrive) -> None:
        self._radius = drive.radius
        self._separation = drive.separation
        self._axle_in_base = drive.axle_in_base_planar
        self._base_in_axle = self._axle_in_base.inverse()
        self.reset()

    def reset(self, left: float = 0.0, right: float = 0.0) -> None:
        """Start anew: the base at the origin, the wheels at these angles in rad."""
        start = self._axle_in_base
        self.state = (start.x, start.y, start.yaw, left, right)

    def update(self, left: float, right: float) -> None:
        """Go on to wheel angles in rad, forwards positive."""
        x, y, yaw, last_left, last_right = self.state
        self.state = _roll(
            x, y, yaw, (left - last_left) * self._radius, (right - last_right) * self._radius,
            self._separation, left, right,
        )  # fmt: skip

    def start_at(self, pose: PlanarPose, left: float, right: float) -> None:
        """Go on from a pose of the base, at these wheel angles."""
        axle = pose @ self._axle_in_base
        self.state = (axle.x, axle.y, axle.yaw, left, right)

    def pose(self, left: float, right: float) -> PlanarPose:
        """The base's pose at these wheel angles, which may be further on than the last update."""
        x, y, yaw, last_left, last_right = self.state
        x, y, yaw, _, _ = _roll(
            x, y, yaw, (left - last_left) * self._radius, (right - last_right) * self._radius,
            self._separation, left, right,
        )  # fmt: skip
        return PlanarPose(x, y, yaw) @ self._base_in_axle

    def twist(self, linear: float, angular: float) -> PlanarTwist:
        """The base's twist in its own frame, from the axle's forward and turning speed."""
        axle = self._axle_in_base
        c, s = math.cos(axle.yaw), math.sin(axle.yaw)
        return PlanarTwist(c * linear + angular * axle.y, s * linear - angular * axle.x, angular)


def _roll(
    x: float, y: float, yaw: float, left: float, right: float, separation: float, a: float, b: float
) -> tuple[float, float, float, float, float]:
    """A step along an arc whose wheels rolled `left` and `right` metres (see kinematics.odometry); `a`
    and `b` are the wheel angles it ends at."""
    half = (right - left) / separation / 2.0
    sinc = math.sin(half) / half if abs(half) > 1e-4 else 1.0 - half * half / 6.0
    chord = (left + right) / 2.0 * sinc
    heading = yaw + half
    return x + chord * math.cos(heading), y + chord * math.sin(heading), heading + half, a, b
