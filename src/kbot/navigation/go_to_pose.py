"""Straight to a pose: turn to it, drive to it, turn as it does. Looks for no obstacles."""

from __future__ import annotations

import math

from kbot.kinematics.odometry import PlanarPose
from kbot.messages import Twist
from kbot.navigation.controller import GENTLE, STILL, Limits, Observation, going_on, twist, wrapped

_AIMED = math.radians(30)
"""Off by more than this, the robot turns before it drives."""
_NEAR = 0.1
"""m within which it drives backwards to what lies behind."""


class GoToPose:
    """`is_done` once the pose is reached; from then on the robot stands still."""

    def __init__(
        self,
        goal: PlanarPose,
        limits: Limits = GENTLE,
        any_heading: bool = False,
        centre: tuple[float, float] = (0.0, 0.0),
    ) -> None:
        """`any_heading`: the goal's yaw does not matter. `centre`: what it turns about, m in the base's
        frame; the base stops where the turn to the goal's yaw takes it to the goal."""
        self.goal, self.limits, self.any_heading = goal, limits, any_heading
        self._centre = centre
        at_goal = goal @ PlanarPose(*centre)
        self._centre_at_goal = at_goal.x, at_goal.y
        self.is_done = False
        self.remaining = math.inf
        """Metres to go."""
        self.heading_error = 0.0
        """rad that are yet to be turned, where it turns on the spot."""
        self._arrived = False

    def update(self, observation: Observation) -> Twist:
        if self.is_done:
            return STILL
        if self.any_heading:
            x, y = observation.in_base(self.goal.x, self.goal.y)
        else:
            x, y = observation.in_base(*self._centre_at_goal)
            x, y = x - self._centre[0], y - self._centre[1]
        self.remaining = math.hypot(x, y)
        # once there, it is not left again for a hair's breadth
        if self._arrived or self.remaining <= self.limits.distance:
            self._arrived = True
            return self._turn(observation)
        backwards = x < 0.0 and self.remaining < _NEAR
        forwards = -1.0 if backwards else 1.0
        bearing = going_on(math.atan2(forwards * y, forwards * x), self.heading_error)
        self.heading_error = bearing
        if abs(bearing) > _AIMED:
            return twist(0.0, self.limits.turn_to(bearing))
        speed = self.limits.speed_to_stop_in(self.remaining) * math.cos(bearing) ** 2
        return twist(forwards * max(speed, 0.02), self.limits.turn_to(bearing))

    def _turn(self, observation: Observation) -> Twist:
        off = 0.0 if self.any_heading else wrapped(self.goal.yaw - observation.pose.yaw)
        self.heading_error, self.remaining = off, 0.0
        if abs(off) <= self.limits.angle:
            self.is_done = True
            return STILL
        return twist(0.0, self.limits.turn_to(off))
