"""The point that a robot turns about on the spot, learned from how it turns."""

from __future__ import annotations

import math

from kbot.kinematics.odometry import PlanarPose
from kbot.messages import Twist
from kbot.navigation.controller import Observation

_ENOUGH = 0.1
"""rad that are turned before a centre is believed."""


class TurningCentre:
    """Watches a robot turn. Wheels that skid, or a base that is not over the axle, move the base then."""

    def __init__(self) -> None:
        self._last: PlanarPose | None = None
        self._forward = self._left = self._turned = 0.0

    def watch(self, observation: Observation, wanted: Twist) -> None:
        """Where the robot is, and what it is told next; only what it does on the spot counts."""
        pose = observation.pose
        if self._last is not None:
            turned = pose.yaw - self._last.yaw
            half_way = PlanarPose(self._last.x, self._last.y, self._last.yaw + turned / 2.0)
            forward, left = Observation(0.0, half_way).in_base(pose.x, pose.y)
            self._forward += math.copysign(forward, forward * turned)
            self._left += math.copysign(left, left * turned)
            self._turned += abs(turned)
        on_the_spot = wanted.linear.x == 0.0 and wanted.angular.z != 0.0
        self._last = pose if on_the_spot else None

    @property
    def in_base(self) -> tuple[float, float]:
        """m, in the frame of the base; its origin until the robot has turned enough."""
        if self._turned < _ENOUGH:
            return 0.0, 0.0
        # a base at -c from a centre that it turns about moves by turn * (c.y, -c.x)
        return -self._left / self._turned, self._forward / self._turned
