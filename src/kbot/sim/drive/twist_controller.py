"""Follows twist commands within the limits of speed, acceleration and jerk."""

from __future__ import annotations

from dataclasses import dataclass
from math import copysign, inf, sqrt

from kbot.kinematics.drive.drive import DifferentialDrive
from kbot.sim.recipe import ANGULAR_ACCELERATION, LINEAR_ACCELERATION
from kbot.text import KbotError


class RateLimiter:
    """Moves a speed towards its target, one period at a time.

    With a jerk limit, `acceleration` is the acceleration at the end of the last period.
    """

    def __init__(
        self, period: float, acceleration: float, deceleration: float | None = None, jerk: float = inf
    ) -> None:
        self._period = period
        self._faster = acceleration
        self._slower = acceleration if deceleration is None else deceleration
        self._jerk = jerk
        self._is_even = self._slower == acceleration and jerk == inf
        """Whether the limit is always the same, as it usually is."""
        self._step = acceleration * period
        self.acceleration = 0.0

    def advance(self, value: float, target: float) -> tuple[float, float]:
        """The speed at the end of a period, and its mean over the period."""
        if self._is_even:
            change, step = target - value, self._step
            if change > step:
                return value + step, value + step / 2.0
            if change < -step:
                return value - step, value - step / 2.0
            return target, value + change - change * abs(change) / (2.0 * step)
        limit = self._faster if abs(target) > abs(value) and target * value >= 0.0 else self._slower
        if self._jerk < inf:
            return self._smoothly(value, target, limit)
        change, step = target - value, limit * self._period
        if change > step:
            return value + step, value + step / 2.0
        if change < -step:
            return value - step, value - step / 2.0
        return target, value + change - change * abs(change) / (2.0 * step)

    def _smoothly(self, value: float, target: float, limit: float) -> tuple[float, float]:
        """One period with limited jerk.

        The acceleration is at most the one that can still fall to 0 before the speed reaches its target.
        """
        period, before, change = self._period, self.acceleration, target - value
        wanted = copysign(min(limit, sqrt(2.0 * self._jerk * abs(change))), change)
        step = self._jerk * period
        after = min(max(wanted, before - step), before + step)
        end = value + (before + after) / 2.0 * period
        if (target - end) * change <= 0.0 or abs(target - end) < step * period / 2.0:
            self.acceleration = 0.0
            return target, (value + target) / 2.0
        self.acceleration = after
        return end, value + before * period / 2.0 + (after - before) * period / 6.0


Twist = tuple[float, float, float]
"""Velocities of the axle's middle: forwards and leftwards in m/s, and the turn in rad/s.

Only a holonomic base moves leftwards."""
STILL: Twist = (0.0, 0.0, 0.0)
SavedTwist = tuple[Twist, Twist, Twist, int | None, float, float, float]


@dataclass(frozen=True, slots=True)
class DriveLimits:
    """Limits of a twist: velocity, acceleration and jerk (m/s, rad/s, m/s^2, rad/s^2, m/s^3, rad/s^3).

    `reverse_velocity` and the decelerations default to the limits of driving forward and accelerating.
    """

    linear_velocity: float = inf
    angular_velocity: float = inf
    linear_acceleration: float = LINEAR_ACCELERATION
    angular_acceleration: float = ANGULAR_ACCELERATION
    reverse_velocity: float | None = None
    linear_deceleration: float | None = None
    angular_deceleration: float | None = None
    linear_jerk: float = inf
    angular_jerk: float = inf
    lateral_velocity: float = inf
    lateral_acceleration: float = LINEAR_ACCELERATION
    lateral_jerk: float = inf

    def __post_init__(self) -> None:
        for name in self.__slots__:
            value = getattr(self, name)
            if value is not None and not (value > 0.0 or (name == "reverse_velocity" and value == 0.0)):
                raise KbotError(f"the limit {name} must be above 0, not {value}")


class TwistController:
    """Follows a commanded twist within limits, one period at a time.

    `wheel_speed` is the highest speed of a wheel in rad/s. A command beyond it is scaled down as a whole, so
    that the curve stays the same.
    """

    def __init__(
        self, drive: DifferentialDrive, limits: DriveLimits, wheel_speed: float, period: float
    ) -> None:
        self.limits = limits
        self.wheel_speed = wheel_speed
        self._back = limits.linear_velocity if limits.reverse_velocity is None else limits.reverse_velocity
        self._drive, self._period = drive, period
        self._linear = RateLimiter(
            period, limits.linear_acceleration, limits.linear_deceleration, limits.linear_jerk
        )
        self._angular = RateLimiter(
            period, limits.angular_acceleration, limits.angular_deceleration, limits.angular_jerk
        )
        self._lateral = RateLimiter(period, limits.lateral_acceleration, jerk=limits.lateral_jerk)
        self.reset()

    @property
    def fastest(self) -> Twist:
        """The highest speeds straight ahead, sideways and on the spot. They are infinite without limits."""
        limits, rim = self.limits, self.wheel_speed * self._drive.radius
        linear = max(limits.linear_velocity, self._back)
        turn = rim / (self._drive.separation / 2.0)
        return min(linear, rim), min(limits.lateral_velocity, rim), min(limits.angular_velocity, turn)

    def reach(self, x: float, y: float, yaw: float, seconds: float, limits: DriveLimits) -> Twist:
        """How far a command moves the drive within other limits, from standstill: m, m and rad."""
        other = TwistController(self._drive, limits, self.wheel_speed, self._period)
        other.set_target(x, y, yaw, None)
        moved = [other.advance()[:3] for _ in range(round(seconds / self._period))]
        x, y, yaw = (self._period * sum(axis) for axis in zip(*moved, strict=True))
        return x, y, yaw

    def reset(self) -> None:
        self.wanted = STILL
        """The last command as given."""
        self.target = STILL
        self.twist = STILL
        self._linear.acceleration = self._lateral.acceleration = self._angular.acceleration = 0.0
        self.deadline: int | None = None
        """The step at which the command times out. None: never."""

    def save(self) -> SavedTwist:
        """The state for `restore`."""
        return (
            self.wanted, self.target, self.twist, self.deadline,
            self._linear.acceleration, self._lateral.acceleration, self._angular.acceleration,
        )  # fmt: skip

    def restore(self, saved: SavedTwist) -> None:
        (
            self.wanted, self.target, self.twist, self.deadline,
            self._linear.acceleration, self._lateral.acceleration, self._angular.acceleration,
        ) = saved  # fmt: skip

    def set_target(self, x: float, y: float, yaw: float, deadline: int | None) -> bool:
        """Set the target to a command of finite numbers, within the limits.

        Returns whether the twist differs from it.
        """
        limits = self.limits
        self.wanted = (x, y, yaw)
        x = min(max(x, -self._back), limits.linear_velocity)
        y = min(max(y, -limits.lateral_velocity), limits.lateral_velocity)
        yaw = min(max(yaw, -limits.angular_velocity), limits.angular_velocity)
        if self._drive.rim_speed(x, y, yaw) / self._drive.radius > self.wheel_speed:
            x, y, yaw = self._slowed(x, y, yaw)
        self.target = (x, y, yaw)
        self.deadline = deadline
        return self.twist != self.target

    def _slowed(self, x: float, y: float, yaw: float) -> Twist:
        """The same curve at the wheels' highest speed. Dividing by `size` first avoids an overflow."""
        size = max(abs(x), abs(y), abs(yaw))
        x, y, yaw = x / size, y / size, yaw / size
        share = self.wheel_speed * self._drive.radius / self._drive.rim_speed(x, y, yaw)
        return x * share, y * share, yaw * share

    def advance(self) -> tuple[float, float, float, bool]:
        """The twist for the next period, and whether it stays constant afterwards.

        It is the period's mean twist, so that the distance driven is exactly that of the ramp, for any length
        of a period.
        """
        x, y, yaw = mean_x, mean_y, mean_yaw = self.twist
        to_x, to_y, to_yaw = self.target
        settled = x == to_x and y == to_y and yaw == to_yaw
        if x != to_x:
            x, mean_x = self._linear.advance(x, to_x)
        if y != to_y:
            y, mean_y = self._lateral.advance(y, to_y)
        if yaw != to_yaw:
            yaw, mean_yaw = self._angular.advance(yaw, to_yaw)
        self.twist = (x, y, yaw)
        return mean_x, mean_y, mean_yaw, settled
