"""Odometry: a robot's pose and twist on the plane, computed from its wheels or commands, or true."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from math import cos, isfinite, sin

from kbot.brief import Brief
from kbot.kinematics.angles import FULL_TURN, wrap
from kbot.kinematics.drive.drive import DifferentialDrive
from kbot.kinematics.planar_pose import PlanarPose, PlanarTwist

UnwrappedPose = tuple[float, float, float]
"""x and y in m, and the yaw in rad with all full turns."""


@dataclass(frozen=True, slots=True, repr=False)
class Motion(Brief):
    """`pose` in the fixed frame and `twist` in the moving frame.

    The yaw of the pose is wrapped: above -pi and at most pi, as that of a quaternion on a topic. `turns` are
    the full turns to the left since the start that it leaves out. `unwrapped_yaw` has both.
    """

    pose: PlanarPose
    twist: PlanarTwist
    turns: int = 0

    @classmethod
    def of(cls, pose: UnwrappedPose, twist: PlanarTwist) -> Motion:
        x, y, unwrapped = pose
        yaw = wrap(unwrapped)
        turns = round((unwrapped - yaw) / FULL_TURN) if isfinite(unwrapped) else 0
        return cls(PlanarPose(x, y, yaw), twist, turns)

    @property
    def unwrapped_yaw(self) -> float:
        """The heading in rad, which counts full turns: 20 pi after ten turns to the left."""
        return self.pose.yaw + FULL_TURN * self.turns


ORIGIN: UnwrappedPose = 0.0, 0.0, 0.0


def composed(pose: UnwrappedPose, offset: PlanarPose) -> UnwrappedPose:
    """As `pose @ offset` of two `PlanarPose`, with a yaw that is not wrapped."""
    x, y, yaw = pose
    c, s = cos(yaw), sin(yaw)
    return x + c * offset.x - s * offset.y, y + s * offset.x + c * offset.y, yaw + offset.yaw


def motion_between(before: UnwrappedPose, now: UnwrappedPose) -> tuple[float, float, float]:
    """The motion in m, m and rad from one pose to another, in the frame of the first."""
    dx, dy, c, s = now[0] - before[0], now[1] - before[1], cos(before[2]), sin(before[2])
    return c * dx + s * dy, c * dy - s * dx, now[2] - before[2]


class WheelOdometry:
    """Computes the pose of the axle from wheel angles, by exact arcs.

    It works on plain numbers, because `update` runs every control period.
    """

    def __init__(self, drive: DifferentialDrive) -> None:
        self._drive = drive
        self._way = drive.radius / 2.0
        self._turn = drive.radius / drive.separation / 2.0
        self._axle_in_base = drive.axle_in_base_planar
        self._base_in_axle = self._axle_in_base.inverse()
        self.reset()

    def reset(self, left: float = 0.0, right: float = 0.0) -> None:
        """Restart with the base at the origin and the wheels at these angles in rad."""
        start = self._axle_in_base
        self.state: tuple[float, ...] = (start.x, start.y, start.yaw, left, right)

    def update(self, left: float, right: float) -> None:
        """Advance to new wheel angles in rad, forwards positive."""
        self.state = self._rolled(left, right)

    @property
    def axle(self) -> UnwrappedPose:
        """The axle's pose as of the last update."""
        x, y, yaw, *_ = self.state
        return x, y, yaw

    def start_at(self, base: UnwrappedPose, left: float, right: float) -> None:
        """Continue from a pose of the base, at these wheel angles."""
        self.state = (*composed(base, self._axle_in_base), left, right)

    def base(self, left: float, right: float) -> UnwrappedPose:
        """The base's pose at these wheel angles, which may be newer than the last update."""
        return composed(self._rolled(left, right)[:3], self._base_in_axle)

    def twist(self, left: float, right: float) -> PlanarTwist:
        """The base's twist in its own frame, from the speeds of the wheels in rad/s."""
        linear, angular = self._drive.twist(left, right)
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


class PlanarOdometry:
    """As `WheelOdometry`, for wheels that steer or drive in every direction.

    Its arguments are how far the wheels drove the base in its own axes: forwards and leftwards in m, and
    turned in rad. For a constant twist the result is exact, as `PlanarPose` integrates arcs.
    """

    def __init__(self, drive: DifferentialDrive) -> None:
        self._axle_in_base = drive.axle_in_base_planar
        self._base_in_axle = self._axle_in_base.inverse()
        self.reset()

    def reset(self, x: float = 0.0, y: float = 0.0, yaw: float = 0.0) -> None:
        self.start_at(ORIGIN, x, y, yaw)

    def start_at(self, base: UnwrappedPose, x: float, y: float, yaw: float) -> None:
        self.state: tuple[float, ...] = (*composed(base, self._axle_in_base), x, y, yaw)

    @property
    def axle(self) -> UnwrappedPose:
        x, y, yaw, *_ = self.state
        return x, y, yaw

    def update(self, x: float, y: float, yaw: float) -> None:
        self.state = self._moved(x, y, yaw)

    def base(self, x: float, y: float, yaw: float) -> UnwrappedPose:
        at_x, at_y, heading, *_ = self._moved(x, y, yaw)
        return composed((at_x, at_y, heading), self._base_in_axle)

    def twist(self, x: float, y: float, yaw: float) -> PlanarTwist:
        axle = self._axle_in_base
        return PlanarTwist(x + yaw * axle.y, y - yaw * axle.x, yaw)

    def _moved(self, x: float, y: float, yaw: float) -> tuple[float, ...]:
        at_x, at_y, heading, last_x, last_y, last_yaw = self.state
        ahead, aside, half = x - last_x, y - last_y, (yaw - last_yaw) / 2.0
        sinc = sin(half) / half if half > 1e-4 or half < -1e-4 else 1.0 - half * half / 6.0
        middle = heading + half
        c, s = cos(middle) * sinc, sin(middle) * sinc
        return at_x + c * ahead - s * aside, at_y + s * ahead + c * aside, middle + half, x, y, yaw


class TrueOdometry:
    """As `WheelOdometry`, for a plugin that publishes the true motion of the base since the start.

    The wheels' angles, its arguments, have no influence.
    """

    def __init__(self, truth: Callable[[], Motion], drive: DifferentialDrive) -> None:
        self._truth, self._axle_in_base = truth, drive.axle_in_base_planar
        self.reset()

    def reset(self, *angles: float) -> None:
        self.start_at(ORIGIN, *angles)

    def start_at(self, base: UnwrappedPose, *angles: float) -> None:
        truth = self._truth()
        odom_from_world = PlanarPose(*base) @ truth.pose.inverse()
        self.state: tuple[float, ...] = (
            odom_from_world.x, odom_from_world.y, base[2] - truth.unwrapped_yaw,
        )  # fmt: skip

    def update(self, *angles: float) -> None:
        """Nothing adds up."""

    @property
    def axle(self) -> UnwrappedPose:
        return composed(self.base(), self._axle_in_base)

    def base(self, *angles: float) -> UnwrappedPose:
        truth, (x, y, yaw) = self._truth(), self.state
        place = PlanarPose(x, y, yaw) @ truth.pose
        return place.x, place.y, yaw + truth.unwrapped_yaw

    def twist(self, *speeds: float) -> PlanarTwist:
        return self._truth().twist


class CommandOdometry:
    """As `WheelOdometry`, for a controller that computes odometry from its commands (`open_loop`).

    The wheels' angles, its arguments, have no influence.
    """

    def __init__(
        self, commanded: Callable[[], tuple[float, float, float]], period: float, drive: DifferentialDrive
    ) -> None:
        """`commanded` returns the twist within limits in m/s and rad/s. `period`: s between updates."""
        self._commanded, self._period = commanded, period
        self._driven = PlanarOdometry(drive)

    @property
    def state(self) -> tuple[float, ...]:
        return self._driven.state

    @state.setter
    def state(self, state: tuple[float, ...]) -> None:
        self._driven.state = state

    def reset(self, *angles: float) -> None:
        self._driven.reset()

    def start_at(self, base: UnwrappedPose, *angles: float) -> None:
        self._driven.start_at(base, 0.0, 0.0, 0.0)

    def update(self, *angles: float) -> None:
        """Advance by one period with the commanded twist."""
        *_, x, y, yaw = self.state
        forward, leftward, turning = (speed * self._period for speed in self._commanded())
        self._driven.update(x + forward, y + leftward, yaw + turning)

    @property
    def axle(self) -> UnwrappedPose:
        return self._driven.axle

    def base(self, *angles: float) -> UnwrappedPose:
        *_, x, y, yaw = self.state
        return self._driven.base(x, y, yaw)

    def twist(self, *speeds: float) -> PlanarTwist:
        return self._driven.twist(*self._commanded())
