"""The interface of navigation controllers, which compute the robot's next speeds from its pose.

A controller is any object with an `update`. This one drives towards a light at a known place:

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

from kbot.brief import Brief
from kbot.kinematics.planar_pose import PlanarPose, PlanarTwist
from kbot.messages import Twist, Vector3
from kbot.navigation.lidar_view import LidarView
from kbot.text import KbotError

STILL = Twist()
AT_REST = PlanarTwist()
_BEHIND = math.radians(150)
"""rad. If a bearing larger than this changes sides, the robot keeps its direction of turning."""
_REST_SPEED = 0.01
_REST_TURNING = 0.15
"""m/s and rad/s below which a robot is at rest. With the default braking it stops within 0.1 mm and 3 mrad: a
hundredth and a seventh of what a goal allows."""
PLANNED_BRAKING = 0.7
"""Share of the braking with which a follower slows down before the end of its path. It can still brake harder
than planned."""


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class Observation(Brief):
    """What a controller knows when it computes a command.

    time           simulated time in s
    pose           of the base in the map
    twist          of the base in its own frame
    obstacles      points (n, 2) in m in the base's frame that a lidar detected; None before a first scan
    obstacles_age  age of the scan in s
    view           where the lidar detects obstacles; None if this is not known
    fallen         a sentence on how a robot lies that fell over, empty for one on its wheels
    fault          a sentence on why it is unsafe to drive on, as with frozen odometry; empty if it is safe
    """

    time: float
    pose: PlanarPose
    twist: PlanarTwist = AT_REST
    obstacles: NDArray[np.float64] | None = None
    obstacles_age: float = math.inf
    fallen: str = ""
    fault: str = ""
    view: LidarView | None = None

    def in_base(self, x: float, y: float) -> tuple[float, float]:
        """A point of the map in the base's frame, in m."""
        return self.pose.local(x, y)

    @property
    def is_at_rest(self) -> bool:
        """Whether the robot neither drives nor turns."""
        motion = self.twist
        return math.hypot(motion.x, motion.y) < _REST_SPEED and abs(motion.yaw) < _REST_TURNING

    def of_point(self, point: PlanarPose) -> Observation:
        """The same observation with the pose of a point of the base's frame instead of the base's pose."""
        return replace(self, pose=self.pose @ point)

    def seen_from(self, point: PlanarPose) -> Observation:
        """The same observation with all that it has of the base for a point that is fixed to the base."""
        if point == PlanarPose():
            return self
        motion, inverse = self.twist, point.inverse()
        x, y = motion.x - motion.yaw * point.y, motion.y + motion.yaw * point.x
        ahead, left = PlanarPose(0.0, 0.0, point.yaw).local(x, y)
        obstacles = None if self.obstacles is None else inverse.apply(self.obstacles)
        moved = PlanarTwist(ahead, left, motion.yaw)
        return replace(self, pose=self.pose @ point, twist=moved, obstacles=obstacles, view=None)


class Controller(Protocol):
    """Called at a steady rate with an observation; returns the twist to command."""

    def update(self, observation: Observation) -> Twist: ...


def required_rate(controller: Controller) -> float:
    """How often a controller must be updated, in Hz: its attribute `required_rate`, 0 without one."""
    rate: float = getattr(controller, "required_rate", 0.0)
    return rate


def top_speeds(controller: Controller) -> tuple[float, float, float] | None:
    """The highest speeds that a controller commands: forward and to the left in m/s, and turning in rad/s.

    They are its attribute `top_speeds`; None without one.
    """
    speeds: tuple[float, float, float] | None = getattr(controller, "top_speeds", None)
    return speeds


def require_rate(controller: Controller, rate: float) -> float:
    """The rate of a pilot in Hz. Raises KbotError: its controller must be updated more often."""
    if rate < required_rate(controller) - 1e-9:
        raise KbotError(
            f"the controller must be updated {required_rate(controller):g} times per second, but the pilot's"
            f" rate is {rate:g} Hz"
        )
    return rate


def twist(linear: float, angular: float) -> Twist:
    """A Twist forward at `linear` m/s that turns left at `angular` rad/s."""
    return Twist(Vector3(linear, 0.0, 0.0), Vector3(0.0, 0.0, angular))


def same_side(angle: float, before: float) -> float:
    """An angle in rad on the side on which it was before, so that the robot keeps its direction of turning
    towards a point behind it."""
    flipped = angle * before < 0.0 and min(abs(angle), abs(before)) > _BEHIND
    return angle - math.copysign(2.0 * math.pi, angle) if flipped else angle


@dataclass(frozen=True, slots=True)
class ControllerLimits:
    """Limits of a controller: speeds in m/s and rad/s, braking in m/s^2 and rad/s^2, and the distance in m
    and the angle in rad at which a goal is reached."""

    linear: float = 0.3
    angular: float = 2.0
    braking: float = 0.6
    turn_braking: float = 4.0
    distance: float = 0.01
    angle: float = 0.02

    def speed_to_stop_in(self, distance: float) -> float:
        """The highest speed in m/s from which the robot stops within a distance in m."""
        return min(self.linear, math.sqrt(2.0 * self.braking * max(distance, 0.0)))

    def turn_to(self, angle: float) -> float:
        """Turning speed in rad/s with which the robot comes to rest after turning by `angle` rad."""
        fastest = min(self.angular, math.sqrt(2.0 * self.turn_braking * abs(angle)), 5.0 * abs(angle))
        return math.copysign(fastest, angle)


GENTLE = ControllerLimits()
