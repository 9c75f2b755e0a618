"""A controller that drives straight to a pose and ignores obstacles: it turns, drives, and turns again."""

from __future__ import annotations

import math

from kbot.brief import Brief
from kbot.kinematics.angles import wrap
from kbot.kinematics.planar_pose import PlanarPose
from kbot.messages import Twist
from kbot.navigation.controller import GENTLE, STILL, ControllerLimits, Observation, same_side, twist

_AIMED = math.radians(30)
"""With a larger bearing to the goal, the robot turns before it drives."""
_NEAR = 0.1
"""m. The robot drives backwards to a goal behind it if the goal is nearer than this."""
_BEHIND = math.radians(120)
"""A near goal with a larger bearing is behind. With 90 degrees, a goal beside the robot would alternate
between ahead and behind."""


class GoToPose(Brief):
    """Drives to a pose. `is_done` is True once the robot has reached it, and the robot then stands still."""

    def __init__(
        self, goal: PlanarPose, limits: ControllerLimits = GENTLE, any_heading: bool = False
    ) -> None:
        """`any_heading`: the goal's yaw does not matter."""
        self.goal, self.limits, self.any_heading = goal, limits, any_heading
        self.is_done = False
        self.remaining = math.inf
        """Distance to the goal in m."""
        self.heading_error = 0.0
        """Angle in rad that is left to turn."""
        self._arrived = False
        self._way = 1.0
        """-1 while the robot drives backwards."""

    def update(self, observation: Observation) -> Twist:
        if self.is_done:
            return STILL
        x, y = observation.in_base(self.goal.x, self.goal.y)
        self.remaining = math.hypot(x, y)
        if not self._arrived and self.remaining <= self.limits.distance:
            if not observation.is_at_rest:
                return STILL  # a robot that turns while it still rolls leaves the goal
            self._arrived = True
        if self._arrived:
            return self._turn(observation)
        if self.remaining < _NEAR and abs(math.atan2(self._way * y, self._way * x)) > _BEHIND:
            self._way = -self._way
        bearing = same_side(math.atan2(self._way * y, self._way * x), self.heading_error)
        self.heading_error = bearing
        if abs(bearing) > _AIMED:
            return twist(0.0, self.limits.turn_to(bearing))
        speed = self.limits.speed_to_stop_in(self.remaining) * math.cos(bearing) ** 2
        return twist(self._way * max(speed, 0.02), self.limits.turn_to(bearing))

    def _turn(self, observation: Observation) -> Twist:
        off = 0.0 if self.any_heading else wrap(self.goal.yaw - observation.pose.yaw)
        self.heading_error, self.remaining = off, 0.0
        if abs(off) <= self.limits.angle:
            self.is_done = True
            return STILL
        return twist(0.0, self.limits.turn_to(off))
