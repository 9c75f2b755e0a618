"""A differential drive: its geometry, and the speeds and motions that go with it."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

from kbot.kinematics.odometry import PlanarPose, integrate
from kbot.kinematics.transform import Transform
from kbot.kinematics.wheels import Wheel


@dataclass(frozen=True, slots=True)
class DifferentialDrive:
    """Two sides of equal wheels on parallel axles.

    `left` and `right` name the driving joints, front to rear; `forward` tells for each whether a
    positive speed of the joint drives forwards (1.0) or backwards (-1.0). `radius` of the wheels and
    `separation` between the middles of left and right ones, in m. `axle_in_base` is the frame in the
    middle of the wheels' centres, x forward, y to the left wheel, in the frame of the link `base`.
    `casters` name the links that bear the robot without driving it.
    """

    left: tuple[str, ...]
    right: tuple[str, ...]
    forward: Mapping[str, float]
    wheels: Mapping[str, Wheel]
    radius: float
    separation: float
    base: str
    axle_in_base: Transform
    casters: tuple[str, ...]

    @property
    def joints(self) -> tuple[str, ...]:
        return self.left + self.right

    @property
    def axle_in_base_planar(self) -> PlanarPose:
        """The axle's middle and heading on the ground plane of the base."""
        x, y, _ = self.axle_in_base.translation
        return PlanarPose(float(x), float(y), self.axle_in_base.yaw)

    def wheel_speeds(self, linear: float, angular: float) -> tuple[float, float]:
        """Left and right wheel speeds in rad/s, forwards positive, for the axle's middle to go `linear` m/s
        and the robot to turn `angular` rad/s."""
        half = angular * self.separation / 2.0
        return (linear - half) / self.radius, (linear + half) / self.radius

    def twist(self, left: float, right: float) -> tuple[float, float]:
        """Linear (m/s) and angular (rad/s) speed of the axle's middle, from wheel speeds in rad/s."""
        return (
            (left + right) * self.radius / 2.0,
            (right - left) * self.radius / self.separation,
        )

    def joint_velocities(self, linear: float, angular: float) -> dict[str, float]:
        """The speed in rad/s that each driving joint takes, its axis's sense considered."""
        left, right = self.wheel_speeds(linear, angular)
        speeds = {name: left * self.forward[name] for name in self.left}
        speeds.update({name: right * self.forward[name] for name in self.right})
        return speeds

    def integrate(self, pose: PlanarPose, left: float, right: float) -> PlanarPose:
        """The base's pose after its left and right wheels turned by `left` and `right` rad, forwards
        positive; exact for constant speeds, and for a base that is not on the axle."""
        return integrate(
            pose, left * self.radius, right * self.radius, self.separation, self.axle_in_base_planar
        )


@dataclass(frozen=True, slots=True)
class NoDrive:
    """Why a robot has no differential drive, in one sentence."""

    reason: str
