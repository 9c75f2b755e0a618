"""Drives straight to a pose: turn, drive, turn. Ignores obstacles."""

from __future__ import annotations

import math

from kbot.kinematics.planar_pose import PlanarPose
from kbot.messages import Twist
from kbot.navigation.controller import GENTLE, STILL, ControllerLimits, Observation, going_on, twist, wrapped

_AIMED = math.radians(30)
"""Off by more than this, the robot turns before it drives."""
_NEAR = 0.1
"""m within which it drives backwards to a goal behind it."""
_BEHIND = math.radians(120)
"""Off by more than this, a near goal is behind: by 90 degrees, a goal beside it would be both in turn."""


class GoToPose:
    """`is_done` once the pose is reached; from then on the robot stands still."""

    def __init__(
        self, goal: PlanarPose, limits: ControllerLimits = GENTLE, any_heading: bool = False
    ) -> None:
        """`any_heading`: the goal's yaw does not matter."""
        self.goal, self.limits, self.any_heading = goal, limits, any_heading
        self.is_done = False
        self.remaining = math.inf
        """Metres to go."""
        self.heading_error = 0.0
        """rad that are yet to be turned, where it turns on the spot."""
        self._arrived = False
        self._way = 1.0
        """-1 while it drives backwards."""

    def update(self, observation: Observation) -> Twist:
        if self.is_done:
            return STILL
        x, y = observation.in_base(self.goal.x, self.goal.y)
        self.remaining = math.hypot(x, y)
        if not self._arrived and self.remaining <= self.limits.distance:
            if not observation.stands:
                return STILL  # a robot that turns while it still rolls leaves the goal
            self._arrived = True
        if self._arrived:
            return self._turn(observation)
        if self.remaining < _NEAR and abs(math.atan2(self._way * y, self._way * x)) > _BEHIND:
            self._way = -self._way
        bearing = going_on(math.atan2(self._way * y, self._way * x), self.heading_error)
        self.heading_error = bearing
        if abs(bearing) > _AIMED:
            return twist(0.0, self.limits.turn_to(bearing))
        speed = self.limits.speed_to_stop_in(self.remaining) * math.cos(bearing) ** 2
        return twist(self._way * max(speed, 0.02), self.limits.turn_to(bearing))

    def _turn(self, observation: Observation) -> Twist:
        off = 0.0 if self.any_heading else wrapped(self.goal.yaw - observation.pose.yaw)
        self.heading_error, self.remaining = off, 0.0
        if abs(off) <= self.limits.angle:
            self.is_done = True
            return STILL
        return twist(0.0, self.limits.turn_to(off))
