"""A robot's pose as its own sensors measure it: the distance from the wheels, the heading from a
gyroscope."""

from __future__ import annotations

import math
from collections import deque

from kbot.kinematics.angles import wrap
from kbot.kinematics.planar_pose import PlanarPose, PlanarTwist

_HISTORY = 200
"""Poses that are kept to place late scans: ten seconds at 20 Hz."""
_STILL = 0.05
"""rad/s. A gyroscope at rest that measures more is turned by hand, or is defective."""
_OFF, _OFF_PER_WAY = 0.03, 0.03
"""m, and a share of the way, by which the scans must contradict the wheels: more than both err."""
_TURNED_OFF, _TURNED_OFF_PER_WAY = 0.05, 0.01
"""The same for the heading, in rad and rad/m."""
_GYRO_SILENCE = 0.15
"""s. The turns of the wheels replace those of a gyroscope that is silent for longer."""
_BIAS_SAMPLES = 500
"""The bias is the mean of at most about this many measurements at rest."""


class PoseEstimate:
    """Integrates wheel odometry and, if there is one, the rate of a gyroscope.

    Wheels that skid, as those of skid-steer robots do in each turn, measure distances well and turns badly.
    The gyroscope's bias is estimated while the wheels stand still.

    Matched scans correct it once they contradict it. Before that, wheels are better: in worlds of the BARN
    challenge, matched scans alone are 0.02 to 0.12 m off after 10 m, the KBot robot's wheels 0.001 m, and
    wheels that are 10 % too large 1 m.
    """

    def __init__(self, start: PlanarPose, drift: float = 0.0, centre: float = 0.0) -> None:
        """`start` is the pose of the base at the first update. `drift` and `centre` as in `MotionLimits`."""
        self._drift, self._centre = drift, centre
        self.twist = PlanarTwist()
        self._integrated, self._correction, self._matched = start, PlanarPose(), PlanarPose()
        self._way = 0.0
        self.is_contradicted = self.has_gyro = False
        self._odometry: PlanarPose | None = None
        self._gyro_time: float | None = None
        self._rate = self._turned = self._bias = 0.0
        self._samples = 0
        self._is_still = True
        self._history: deque[tuple[float, PlanarPose]] = deque(maxlen=_HISTORY)

    @property
    def pose(self) -> PlanarPose:
        return self._correction @ self._integrated

    @property
    def by_scans(self) -> PlanarPose:
        """The pose by matched scans, and since the last one by odometry and gyroscope."""
        return self._matched @ self._integrated

    def by_scans_at(self, time: float) -> PlanarPose:
        """The same at an earlier time in s."""
        return self._matched @ self._integrated_at(time)

    def add_match(self, time: float, pose: PlanarPose) -> None:
        """Process the pose at an earlier time in s that a matched scan shows."""
        integrated = self._integrated_at(time)
        self._matched = pose @ integrated.inverse()
        off = math.hypot(pose.x - integrated.x, pose.y - integrated.y)
        turned_off = abs(wrap(pose.yaw - integrated.yaw))
        if (
            off > _OFF + _OFF_PER_WAY * self._way
            or turned_off > _TURNED_OFF + _TURNED_OFF_PER_WAY * self._way
        ):
            self.is_contradicted = True
        if self.is_contradicted:
            self._correction = self._matched

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
        has_gyro = self.has_gyro = self._gyro_time is not None and time - self._gyro_time < _GYRO_SILENCE
        turned = self._turned if has_gyro else moved.yaw
        # the chord of the odometry's arc, turned by half of the true turn
        half = PlanarPose(0.0, 0.0, (turned - moved.yaw) / 2.0)
        rate = self._rate if has_gyro else twist.yaw
        across = self._drift * moved.x * rate + self._centre * turned
        step = half @ PlanarPose(moved.x, moved.y - across)
        self._integrated = self._integrated @ PlanarPose(step.x, step.y, turned)
        self._way += math.hypot(step.x, step.y)
        self.twist = PlanarTwist(twist.x, twist.y, rate)
        self._odometry, self._turned = pose, 0.0
        self._history.append((time, self._integrated))

    def at(self, time: float) -> PlanarPose:
        """The pose at an earlier time in s, interpolated."""
        return self._correction @ self._integrated_at(time)

    def _integrated_at(self, time: float) -> PlanarPose:
        later = self._integrated
        later_time = math.inf
        for then, pose in reversed(self._history):
            if then <= time:
                if math.isinf(later_time):
                    return pose
                share = (time - then) / (later_time - then)
                return PlanarPose(
                    pose.x + share * (later.x - pose.x),
                    pose.y + share * (later.y - pose.y),
                    wrap(pose.yaw + share * wrap(later.yaw - pose.yaw)),
                )
            later, later_time = pose, then
        return later
