"""The speeds and accelerations that a controller may use."""

from __future__ import annotations

import math
import reprlib
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from kbot.kinematics.bodies import center_of_mass
from kbot.kinematics.drive.drive import DifferentialDrive, HolonomicDrive, SteeredDrive
from kbot.kinematics.frames import FrameTree
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
_SKID_DRIFT = 0.18
"""s. Measured on a skid-steer robot of 17 kg at -0.5 to 2 m/s. All its tyres slip in a curve, so that little
is left of their grip across."""
_SKID_CENTRE = 2.0
"""How many times further than the centre of mass the point is ahead of the axle about which the robot turns
on the spot: the wheels that carry more hold more. Measured on the same robot: 1.8 to 2.3."""


@dataclass(frozen=True, slots=True)
class MotionLimits:
    """The highest speeds (m/s, rad/s), the accelerations with which they change (m/s^2, rad/s^2), and the
    acceleration across the robot in a curve (m/s^2).

    `drift` (s) times the acceleration across is the speed with which the base drifts out of a curve. `centre`
    (m) is how far ahead of its middle a base turns that does not steer.

    `lateral` is the highest speed sideways, 0 for a base that cannot. `curvature` (1/m) is that of the
    sharpest curve, infinite for a base that turns on the spot, and `steering_time` the seconds in which the
    wheels steer from one limit to the other."""

    linear: float
    angular: float
    acceleration: float = _GRIP
    angular_acceleration: float = _TURN_GRIP
    curve_acceleration: float = _CURVE_GRIP
    drift: float = 0.0
    centre: float = 0.0
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
    skid, centre = skidding(robot)
    return MotionLimits(linear, angular, acceleration, angular_acceleration, drift=skid, centre=centre)


def skidding(robot: SimulatedRobot) -> tuple[float, float]:
    """The `drift` and the `centre` of a base. Both are 0 unless it has several wheels on each side, which
    skid."""
    drive = robot.drive
    if not isinstance(drive, DifferentialDrive) or isinstance(drive, SteeredDrive | HolonomicDrive):
        return 0.0, 0.0
    if len(drive.left) < 2:
        return 0.0, 0.0
    mass = center_of_mass(FrameTree(robot.robot), drive.base)
    ahead = 0.0 if mass is None else float(mass[0]) - drive.axle_in_base_planar.x
    return _SKID_DRIFT, _SKID_CENTRE * ahead
