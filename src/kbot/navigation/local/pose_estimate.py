"""A robot's pose as its own sensors measure it: the distance from the wheels, the heading from a
gyroscope."""

from __future__ import annotations

import math
from collections import deque

from kbot.kinematics.planar_pose import PlanarPose, PlanarTwist

_HISTORY = 200
"""Poses that are kept to place late scans: ten seconds at 20 Hz."""
_STILL = 0.05
"""rad/s. A gyroscope at rest that measures more is turned by hand, or is defective."""
_BIAS_SAMPLES = 500
"""The bias is the mean of at most about this many measurements at rest."""


class PoseEstimate:
    """Integrates wheel odometry and, if there is one, the rate of a gyroscope.

    Wheels that skid, as those of skid-steer robots do in each turn, measure distances well and turns badly.
    The gyroscope's bias is estimated while the wheels stand still.

    Scans are not matched. In 67 worlds of the BARN challenge, the estimate of a skid-steer robot was 0.16 m
    off after 10 m (median), and no contact came from it: the grid needs the pose over the last metres only.
    """

    def __init__(self, start: PlanarPose, drift: float = 0.0) -> None:
        """`start` is the pose of the base at the first update. `drift` as in `MotionLimits`."""
        self._drift = drift
        self.pose, self.twist = start, PlanarTwist()
        self._odometry: PlanarPose | None = None
        self._gyro_time: float | None = None
        self._rate = self._turned = self._bias = 0.0
        self._samples = 0
        self._is_still = True
        self._history: deque[tuple[float, PlanarPose]] = deque(maxlen=_HISTORY)

    def add_rate(self, time: float, rate: float) -> None:
        """Process a turning speed about the vertical in rad/s that a gyroscope measured."""
        if self._is_still and abs(rate) < _STILL:
            self._samples = min(self._samples + 1, _BIAS_SAMPLES)
            self._bias += (rate - self._bias) / self._samples
        rate -= self._bias
        if self._gyro_time is not None and time > self._gyro_time:
            self._turned += (self._rate + rate) / 2.0 * (time - self._gyro_time)
        self._gyro_time, self._rate = time, rate

    def add_odometry(self, time: float, pose: PlanarPose, twist: PlanarTwist) -> None:
        """Process the pose and the twist that the wheels' odometry reports."""
        before = self._odometry if self._odometry is not None else pose
        moved = before.inverse() @ pose
        self._is_still = moved == PlanarPose() or (abs(twist.x) < 1e-3 and abs(twist.yaw) < 1e-3)
        has_gyro = self._gyro_time is not None
        turned = self._turned if has_gyro else moved.yaw
        # the chord of the odometry's arc, turned by half of the true turn
        half = PlanarPose(0.0, 0.0, (turned - moved.yaw) / 2.0)
        rate = self._rate if has_gyro else twist.yaw
        step = half @ PlanarPose(moved.x, moved.y - self._drift * moved.x * rate)
        self.pose = self.pose @ PlanarPose(step.x, step.y, turned)
        self.twist = PlanarTwist(twist.x, twist.y, rate)
        self._odometry, self._turned = pose, 0.0
        self._history.append((time, self.pose))

    def at(self, time: float) -> PlanarPose:
        """The pose at an earlier time in s, interpolated."""
        later = self.pose
        later_time = math.inf
        for then, pose in reversed(self._history):
            if then <= time:
                if math.isinf(later_time):
                    return pose
                share = (time - then) / (later_time - then)
                return PlanarPose(*(
                    a + share * (b - a)
                    for a, b in zip((pose.x, pose.y, pose.yaw), (later.x, later.y, later.yaw), strict=True)
                ))  # fmt: skip
            later, later_time = pose, then
        return later
