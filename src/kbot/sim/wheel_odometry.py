"""Pose and twist of a robot on the plane, and odometry from its wheels."""

from __future__ import annotations

from dataclasses import dataclass
from math import cos, sin

from kbot.kinematics.drive.drive import DifferentialDrive
from kbot.kinematics.planar_pose import PlanarPose, PlanarTwist


@dataclass(frozen=True, slots=True)
class Motion:
    """`pose` in the fixed frame (its yaw counts full turns), `twist` in the moving one."""

    pose: PlanarPose
    twist: PlanarTwist


class WheelOdometry:
    """Reckons the pose of the axle from wheel angles, by exact arcs, with no object made on the way."""

    def __init__(self, drive: DifferentialDrive) -> None:
        self._way = drive.radius / 2.0
        self._turn = drive.radius / drive.separation / 2.0
        self._axle_in_base = drive.axle_in_base_planar
        self._base_in_axle = self._axle_in_base.inverse()
        self.reset()

    def reset(self, left: float = 0.0, right: float = 0.0) -> None:
        """Start anew: the base at the origin, the wheels at these angles in rad."""
        start = self._axle_in_base
        self.state = (start.x, start.y, start.yaw, left, right)

    def update(self, left: float, right: float) -> None:
        """Go on to wheel angles in rad, forwards positive."""
        self.state = self._rolled(left, right)

    def start_at(self, pose: PlanarPose, left: float, right: float) -> None:
        """Go on from a pose of the base, at these wheel angles."""
        axle = pose @ self._axle_in_base
        self.state = (axle.x, axle.y, axle.yaw, left, right)

    def pose(self, left: float, right: float) -> PlanarPose:
        """The base's pose at these wheel angles, which may be further on than the last update."""
        x, y, yaw, _, _ = self._rolled(left, right)
        return PlanarPose(x, y, yaw) @ self._base_in_axle

    def twist(self, linear: float, angular: float) -> PlanarTwist:
        """The base's twist in its own frame, from the axle's forward and turning speed."""
        axle = self._axle_in_base
        c, s = cos(axle.yaw), sin(axle.yaw)
        return PlanarTwist(c * linear + angular * axle.y, s * linear - angular * axle.x, angular)

    def _rolled(self, left: float, right: float) -> tuple[float, float, float, float, float]:
        """A step along an arc (see kinematics.odometry) from the last update to these wheel angles."""
        x, y, yaw, last_left, last_right = self.state
        to_left, to_right = left - last_left, right - last_right
        half = (to_right - to_left) * self._turn
        sinc = sin(half) / half if half > 1e-4 or half < -1e-4 else 1.0 - half * half / 6.0
        chord = (to_left + to_right) * self._way * sinc
        heading = yaw + half
        return x + chord * cos(heading), y + chord * sin(heading), heading + half, left, right
