"""The speeds and accelerations that a controller may use."""

from __future__ import annotations

import math
import reprlib
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from kbot.kinematics.drive.drive import DifferentialDrive, HolonomicDrive, SteeredDrive
from kbot.navigation.controller import GENTLE
from kbot.sim.numbers import is_finite
from kbot.sim.robot import SimulatedRobot
from kbot.text import KbotError

Speeds = NDArray[np.floating[Any]]

_GRIP = 3.0
"""m/s^2. Declared accelerations are often higher, but tyres of skid-steer robots slip beyond about 0.3 g."""
_RESERVE = 0.8
"""Share of the acceleration that a controller uses, so that the robot can brake harder than planned."""
_TURN_GRIP = 8.0
"""rad/s^2. The same for turns, measured on a skid-steer robot of 0.4 m that declares 25 rad/s^2."""
_CURVE_GRIP = 1.5
"""m/s^2. Highest acceleration across the robot in a curve. A skid-steer robot drifts sideways at 0.4 m/s in a
curve with 2.5 m/s^2, and the wheels do not measure that."""
_SKID_DRIFT = 0.17
"""s. Measured on a skid-steer robot of 17 kg in curves of 0.6 to 1.9 m/s. All its tyres slip in a curve, so
that little is left of their grip across."""


@dataclass(frozen=True, slots=True)
class MotionLimits:
    """The highest speeds (m/s, rad/s), the accelerations with which they change (m/s^2, rad/s^2), and the
    acceleration across the robot in a curve (m/s^2).

    `drift` (s) times the acceleration across is the speed with which the base drifts out of a curve.

    `lateral` is the highest speed sideways, 0 for a base that cannot. `curvature` (1/m) is that of the
    sharpest curve, infinite for a base that turns on the spot, and `steering_time` the seconds in which the
    wheels steer from one limit to the other."""

    linear: float
    angular: float
    acceleration: float = _GRIP
    angular_acceleration: float = _TURN_GRIP
    curve_acceleration: float = _CURVE_GRIP
    drift: float = 0.0
    lateral: float = 0.0
    curvature: float = math.inf
    steering_time: float = 0.2

    def __post_init__(self) -> None:
        values = (
            self.linear, self.angular, self.acceleration, self.angular_acceleration, self.curve_acceleration
        )  # fmt: skip
        if not all(math.isfinite(value) and value > 0.0 for value in values):
            raise KbotError("the limits of speed and acceleration must be finite numbers above 0")

    def turn_at(self, speed: Speeds) -> Speeds:
        """The highest turning speed in rad/s at forward speeds in m/s."""
        slow = self.curve_acceleration / self.angular
        highest: Speeds = self.curve_acceleration / np.maximum(np.abs(speed), slow)
        return highest


def motion_limits(robot: SimulatedRobot, max_speed: tuple[float, float] | None = None) -> MotionLimits:
    """The limits that a robot's description and controller declare, at most `max_speed` (m/s, rad/s).

    A speed without a declared limit is limited to that of goals with a map.

    Raises: KbotError: `max_speed` is not two finite numbers above 0."""
    if max_speed is not None:
        speeds: object = max_speed
        is_pair = isinstance(speeds, tuple | list | np.ndarray) and len(speeds) == 2
        if not (is_pair and all(map(is_finite, max_speed))):
            raise KbotError(
                f"max_speed must be two finite numbers in m/s and rad/s, not {reprlib.repr(speeds)}"
            )
        max_speed = max_speed[0], max_speed[1]
    declared = (math.inf, math.inf, math.inf)
    acceleration, angular_acceleration = _GRIP, _TURN_GRIP
    if robot.wheels is not None and robot.settings is not None:
        declared, limits = robot.wheels.fastest, robot.settings.limits
        slower = limits.linear_deceleration or limits.linear_acceleration
        acceleration = min(acceleration, limits.linear_acceleration, slower)
        slower = limits.angular_deceleration or limits.angular_acceleration
        angular_acceleration = min(angular_acceleration, limits.angular_acceleration, slower)
    acceleration *= _RESERVE
    wanted = max_speed or (
        GENTLE.linear if math.isinf(declared[0]) else math.inf,
        GENTLE.angular if math.isinf(declared[2]) else math.inf,
    )
    linear, angular = min(declared[0], wanted[0]), min(declared[2], wanted[1])
    return MotionLimits(linear, angular, acceleration, angular_acceleration, drift=drift(robot))


def drift(robot: SimulatedRobot) -> float:
    """The drift of a skid-steer base, which has several wheels on each side; 0 for others."""
    drive = robot.drive
    if not isinstance(drive, DifferentialDrive) or isinstance(drive, SteeredDrive | HolonomicDrive):
        return 0.0
    return _SKID_DRIFT if len(drive.left) > 1 else 0.0
