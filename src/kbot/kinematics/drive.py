"""A differential drive: its geometry, and the speeds and motions that go with it."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

from kbot.kinematics.odometry import PlanarPose, integrate
from kbot.kinematics.transform import Transform
from kbot.kinematics.wheels import Wheel


@dataclass(frozen=True, slots=True)
class DifferentialDrive:
    """Two sides of equal wheels on parallel axles.

    `left` and `right` name the driving joints, front to rear. They are the sides that the robot's plugin or
    controller names; without one, those on which the wheels stand. `forward` is the sign of the speed that a
    joint is commanded for driving forwards. `radius` is that of the wheels and `separation` the distance
    between the middles of left and right ones, in m; both are positive. `axle_in_base` is the frame in the
    middle of the wheels' centres, x forward, y to the wheels that stand on the left, in the frame of the link
    `base`. `casters` name the links that bear the robot without driving it.
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
    def mistakes(self) -> dict[str, str]:
        """What the plugin or controller gets wrong, by joint: the robot then does not move as commanded."""
        found: dict[str, str] = {}
        axle_from_base, leftward = self.axle_in_base.inverse(), self.axle_in_base.rotation[:, 1]
        for side, names in (("left", self.left), ("right", self.right)):
            for name in names:
                wheel = self.wheels[name]
                true = "left" if axle_from_base.apply(wheel.center)[1] > 0.0 else "right"
                if (wheel.axis @ leftward) * self.forward[name] < 0.0:
                    found[name] = f"a positive speed of '{name}', as the drive commands it, drives backwards"
                elif side != true:
                    what = f"the drive names '{name}' as {side}, and its wheel is on the {true}"
                    found[name] = f"{what}: turns are reversed"
        return found

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


def named_twice(left: Sequence[str], right: Sequence[str]) -> tuple[str, str] | None:
    """A joint that is named twice, and in words how; None if each is named once.

    gazebo_ros_diff_drive and diff_drive_controller do not start with such names.
    """
    sides: dict[str, str] = {}
    for side, names in (("left", left), ("right", right)):
        for name in names:
            before = sides.get(name)
            if before is not None:
                twice = f"twice as {side}" if before == side else "both as left and as right"
                return name, f"the joint '{name}' {twice}"
            sides[name] = side
    return None


def with_sides(
    drive: DifferentialDrive | NoDrive, left: Sequence[str], right: Sequence[str]
) -> DifferentialDrive | NoDrive:
    """The drive as its plugin or controller commands it, which names joints as left and as right.

    The plugin decides which joints are left and right, not their position. gazebo_ros_diff_drive, gz's
    DiffDrive and diff_drive_controller all command (v - w s/2)/r to the joints named left and (v + w s/2)/r
    to those named right, and compute the turn of their odometry from right minus left. With exchanged names
    the robot therefore turns against the command, while the odometry agrees with the command. The speed is
    that of the joint: where its axis points to the right, a positive speed drives backwards. A joint that is
    not named stays on the side where its wheel stands, and is turned as its axis requires.
    """
    twice = named_twice(left, right)
    if twice is not None:
        return NoDrive(f"its drive names {twice[1]}")
    if isinstance(drive, NoDrive):
        return drive
    ahead = drive.axle_in_base.rotation[:, 0]
    joints = sorted(drive.joints, key=lambda name: -float(drive.wheels[name].center @ ahead))
    lefts = tuple(n for n in joints if n in left or (n in drive.left and n not in right))
    rights = tuple(n for n in joints if n not in lefts)
    if not lefts or not rights:
        return NoDrive(f"its drive names no joint as {'right' if lefts else 'left'}")
    named = dict.fromkeys((*left, *right), 1.0)
    forward = {name: named.get(name, sign) for name, sign in drive.forward.items()}
    return replace(drive, left=lefts, right=rights, forward=forward)
