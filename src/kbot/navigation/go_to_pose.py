"""Straight to a pose: turn to it, drive to it, turn as it does. Looks for no obstacles."""

from __future__ import annotations

import math

from kbot.kinematics.odometry import PlanarPose
from kbot.messages import Twist
from kbot.navigation.controller import GENTLE, STILL, Limits, Observation, twist, wrapped

_AIMED = math.radians(30)
"""Off by more than this, the robot turns before it drives."""


class GoToPose:
    """`is_done` once the pose is reached; from then on the robot stands still."""

    def __init__(self, goal: PlanarPose, limits: Limits = GENTLE, any_heading: bool = False) -> None:
        """`any_heading`: the goal's yaw does not matter."""
        self.goal, self.limits, self.any_heading = goal, limits, any_heading
        self.is_done = False
        self.remaining = math.inf
        """Metres to go."""
        self.heading_error = 0.0
        """rad that are yet to be turned, where it turns on the spot."""
        self._arrived = False

    def update(self, observation: Observation) -> Twist:
        if self.is_done:
            return STILL
        x, y = observation.in_base(self.goal.x, self.goal.y)
        self.remaining = math.hypot(x, y)
        # once there, it is not left again for a hair's breadth
        if self._arrived or self.remaining <= self.limits.distance:
            self._arrived = True
            return self._turn(observation)
        bearing = math.atan2(y, x)
        self.heading_error = bearing
        if abs(bearing) > _AIMED:
            return twist(0.0, self.limits.turn_to(bearing))
        speed = self.limits.speed_to_stop_in(self.remaining) * math.cos(bearing) ** 2
        return twist(max(speed, 0.02), self.limits.turn_to(bearing))

    def _turn(self, observation: Observation) -> Twist:
        off = 0.0 if self.any_heading else wrapped(self.goal.yaw - observation.pose.yaw)
        self.heading_error, self.remaining = off, 0.0
        if abs(off) <= self.limits.angle:
            self.is_done = True
            return STILL
        return twist(0.0, self.limits.turn_to(off))
