"""The interface of navigation controllers: from the robot's pose to its next speeds.

A controller is any object with an `update`; this one drives towards a light it knows the place of:

    class TowardsTheLight:
        def update(self, observation: Observation) -> Twist:
            x, y = observation.in_base(1.0, 2.0)
            return twist(0.2, 1.5 * math.atan2(y, x))
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from kbot.kinematics.planar_pose import PlanarPose, PlanarTwist
from kbot.messages import Twist, Vector3

STILL = Twist()
AT_REST = PlanarTwist()
_BEHIND = math.radians(150)
_STANDS = 0.01
_STANDS_TURNING = 0.15
"""m/s and rad/s below which a robot is at rest. With the default braking it stops within 0.1 mm and 3 mrad: a
hundredth and a seventh of what a goal allows."""


@dataclass(frozen=True, slots=True, eq=False)
class Observation:
    """What a controller is told: the time in s, the base's pose in the map and its twist in its own frame.

    `obstacles` (n, 2) are points in m in the base's frame that a lidar saw `obstacles_age` seconds ago;
    None where there is no lidar, or it has not said anything yet. `lies` says how the robot lies that does
    not stand on its wheels, and is empty where it does.
    """

    time: float
    pose: PlanarPose
    twist: PlanarTwist = AT_REST
    obstacles: NDArray[np.float64] | None = None
    obstacles_age: float = math.inf
    lies: str = ""

    def in_base(self, x: float, y: float) -> tuple[float, float]:
        """A point of the map in the base's frame; m."""
        return self.pose.local(x, y)

    @property
    def stands(self) -> bool:
        """Whether the robot neither drives nor turns."""
        motion = self.twist
        return math.hypot(motion.x, motion.y) < _STANDS and abs(motion.yaw) < _STANDS_TURNING

    def of_point(self, point: PlanarPose) -> Observation:
        """The same with the pose of a point of the base's frame in place of the base's."""
        return replace(self, pose=self.pose @ point)


class Controller(Protocol):
    """Called at a steady rate with what is known; says forward m/s and turning rad/s."""

    def update(self, observation: Observation) -> Twist: ...


def twist(linear: float, angular: float) -> Twist:
    """Forward at `linear` m/s, turning left at `angular` rad/s."""
    return Twist(Vector3(linear, 0.0, 0.0), Vector3(0.0, 0.0, angular))


def wrapped(angle: float) -> float:
    """The same angle within half a turn; rad."""
    return math.remainder(angle, 2.0 * math.pi)


def going_on(angle: float, before: float) -> float:
    """An angle on the side where it was before, in rad: what lies behind is turned to one way only."""
    flipped = angle * before < 0.0 and min(abs(angle), abs(before)) > _BEHIND
    return angle - math.copysign(2.0 * math.pi, angle) if flipped else angle


@dataclass(frozen=True, slots=True)
class ControllerLimits:
    """How fast a controller drives and turns (m/s, rad/s), how hard it brakes (m/s^2, rad/s^2), and what
    is near enough (m, rad)."""

    linear: float = 0.3
    angular: float = 2.0
    braking: float = 0.6
    turn_braking: float = 4.0
    distance: float = 0.01
    angle: float = 0.02

    def speed_to_stop_in(self, distance: float) -> float:
        """The fastest from which the robot stops within a distance; m/s."""
        return min(self.linear, math.sqrt(2.0 * self.braking * max(distance, 0.0)))

    def turn_to(self, angle: float) -> float:
        """Turning speed in rad/s to come to a stop at a heading that is off by `angle` rad."""
        fastest = min(self.angular, math.sqrt(2.0 * self.turn_braking * abs(angle)), 5.0 * abs(angle))
        return math.copysign(fastest, angle)


GENTLE = ControllerLimits()
