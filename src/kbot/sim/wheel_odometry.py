"""Wheel odometry: a robot's pose and twist on the plane, computed from its wheels."""

from __future__ import annotations

from dataclasses import dataclass
from math import cos, sin

from kbot.kinematics.drive.drive import DifferentialDrive
from kbot.kinematics.planar_pose import PlanarPose, PlanarTwist


@dataclass(frozen=True, slots=True)
class Motion:
    """`pose` in the fixed frame (its yaw counts full turns) and `twist` in the moving frame."""

    pose: PlanarPose
    twist: PlanarTwist


class WheelOdometry:
    """Computes the pose of the axle from wheel angles, by exact arcs.

    It works on plain numbers, because `update` runs every control period.
    """

    def __init__(self, drive: DifferentialDrive) -> None:
        self._way = drive.radius / 2.0
        self._turn = drive.radius / drive.separation / 2.0
        self._axle_in_base = drive.axle_in_base_planar
        self._base_in_axle = self._axle_in_base.inverse()
        self.reset()

    def reset(self, left: float = 0.0, right: float = 0.0) -> None:
        """Restart with the base at the origin and the wheels at these angles in rad."""
        start = self._axle_in_base
        self.state = (start.x, start.y, start.yaw, left, right)

    def update(self, left: float, right: float) -> None:
        """Advance to new wheel angles in rad, forwards positive."""
        self.state = self._rolled(left, right)

    def start_at(self, pose: PlanarPose, left: float, right: float) -> None:
        """Continue from a pose of the base, at these wheel angles."""
        axle = pose @ self._axle_in_base
        self.state = (axle.x, axle.y, axle.yaw, left, right)

    def pose(self, left: float, right: float) -> PlanarPose:
        """The base's pose at these wheel angles, which may be newer than the last update."""
        x, y, yaw, _, _ = self._rolled(left, right)
        return PlanarPose(x, y, yaw) @ self._base_in_axle

    def twist(self, linear: float, angular: float) -> PlanarTwist:
        """The base's twist in its own frame, from the axle's linear and angular velocity."""
        axle = self._axle_in_base
        c, s = cos(axle.yaw), sin(axle.yaw)
        return PlanarTwist(c * linear + angular * axle.y, s * linear - angular * axle.x, angular)

    def _rolled(self, left: float, right: float) -> tuple[float, float, float, float, float]:
        """Advance along an arc from the last update to these wheel angles."""
        x, y, yaw, last_left, last_right = self.state
        to_left, to_right = left - last_left, right - last_right
        half = (to_right - to_left) * self._turn
        sinc = sin(half) / half if half > 1e-4 or half < -1e-4 else 1.0 - half * half / 6.0
        chord = (to_left + to_right) * self._way * sinc
        heading = yaw + half
        return x + chord * cos(heading), y + chord * sin(heading), heading + half, left, right
