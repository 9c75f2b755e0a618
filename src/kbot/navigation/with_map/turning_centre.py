"""Learns the point about which a robot turns on the spot."""

from __future__ import annotations

import math

from kbot.kinematics.angles import wrap
from kbot.kinematics.planar_pose import PlanarPose
from kbot.messages import Twist
from kbot.navigation.controller import GENTLE, Observation

_ENOUGH = 0.5
"""rad of turning before a centre is used. A drift of 5 mm then shifts it by 1 cm, which a goal allows."""
_BRAKING = GENTLE.braking / 4.0
"""m/s^2 with which any robot stops: corrections are driven with this braking too."""


class TurningCentre:
    """Learns the point about which a robot turns on the spot.

    It is not the base's origin if wheels skid or the axle is not under the base. A turn counts once the robot
    has stopped: while it still rolls forward, it moves as if it turned about a point far to its side.
    """

    def __init__(self) -> None:
        self.in_base = PlanarPose()
        """The centre in m in the base's frame (its yaw is 0), after the last complete turn."""
        self._last: PlanarPose | None = None
        self._stopped: float | None = None
        """The time in s at which the turn counts; None while the robot does not turn on the spot."""
        self._forward = self._left = self._turned = 0.0

    def watch(self, observation: Observation, wanted: Twist) -> None:
        """Process the robot's pose, and the command that holds until the next observation."""
        if self._last is not None:
            self._add(self._last, observation.pose)
        if wanted.linear.x == 0.0 and wanted.angular.z != 0.0:
            if self._stopped is None:
                self._stopped = observation.time + abs(observation.twist.x) / _BRAKING
            if observation.time >= self._stopped:
                self._last = observation.pose
        else:
            self.interrupt()
            if self._turned >= _ENOUGH:
                # a base at -c from the centre moves by turn * (c.y, -c.x)
                self.in_base = PlanarPose(-self._left / self._turned, self._forward / self._turned)

    def interrupt(self) -> None:
        """Expect a jump before the next observation, because the robot may be placed elsewhere."""
        self._last = self._stopped = None

    def _add(self, before: PlanarPose, now: PlanarPose) -> None:
        turned = wrap(now.yaw - before.yaw)
        half_way = PlanarPose(before.x, before.y, before.yaw + turned / 2.0)
        forward, left = half_way.local(now.x, now.y)
        self._forward += math.copysign(forward, forward * turned)
        self._left += math.copysign(left, left * turned)
        self._turned += abs(turned)
