"""From twist commands to the twist that the wheels are told: limits, slew, and a watchdog."""

from __future__ import annotations

import math
from dataclasses import dataclass

from kbot.kinematics.differential_drive import DifferentialDrive
from kbot.sim.recipe import ANGULAR_ACCELERATION, LINEAR_ACCELERATION
from kbot.text import KbotError

Twist2 = tuple[float, float]
"""Forward speed in m/s and turning speed in rad/s of the axle's middle."""


@dataclass(frozen=True, slots=True)
class DriveLimits:
    """What a twist may be and how fast it may change; m/s, rad/s, m/s^2, rad/s^2."""

    linear_velocity: float = math.inf
    angular_velocity: float = math.inf
    linear_acceleration: float = LINEAR_ACCELERATION
    angular_acceleration: float = ANGULAR_ACCELERATION

    def __post_init__(self) -> None:
        for name in self.__slots__:
            value = getattr(self, name)
            if not value > 0.0:
                raise KbotError(f"a limit of {name.replace('_', ' ')} is above zero, not {value}")


class TwistController:
    """Follows a commanded twist under limits, one period at a time.

    `wheel_speed` is the greatest speed of a wheel in rad/s: a command beyond it is scaled down as a
    whole, so that the curve stays the same.
    """

    def __init__(
        self, drive: DifferentialDrive, limits: DriveLimits, wheel_speed: float, period: float
    ) -> None:
        self.drive = drive
        self.limits = limits
        self.wheel_speed = wheel_speed
        self.period = period
        self.reset()

    def reset(self) -> None:
        self.target: Twist2 = (0.0, 0.0)
        self.twist: Twist2 = (0.0, 0.0)
        self.deadline: int | None = None
        """The step at which the command is taken for lost; None when it holds."""

    def command(self, linear: float, angular: float, deadline: int | None) -> None:
        """Take a command, within the limits.

        Raises:
            KbotError: a number that is not finite.
        """
        if not (math.isfinite(linear) and math.isfinite(angular)):
            raise KbotError(f"a speed command is two finite numbers, not {linear}, {angular}")
        v = _within(linear, self.limits.linear_velocity)
        w = _within(angular, self.limits.angular_velocity)
        fastest = max(abs(speed) for speed in self.drive.wheel_speeds(v, w))
        if fastest > self.wheel_speed:
            v, w = v * self.wheel_speed / fastest, w * self.wheel_speed / fastest
        self.target = (v, w)
        self.deadline = deadline

    @property
    def is_there(self) -> bool:
        return self.twist == self.target

    def advance(self) -> Twist2:
        """The twist of the next period."""
        v, w = self.twist
        self.twist = (
            _toward(v, self.target[0], self.limits.linear_acceleration * self.period),
            _toward(w, self.target[1], self.limits.angular_acceleration * self.period),
        )
        return self.twist


def _within(value: float, limit: float) -> float:
    return min(max(value, -limit), limit)


def _toward(value: float, target: float, step: float) -> float:
    if target > value:
        return min(value + step, target)
    return max(value - step, target)
