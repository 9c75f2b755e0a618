"""Finds what makes it unsafe to drive on: frozen odometry, a robot that is carried, lifted or blocked."""

from __future__ import annotations

import math
from collections import deque
from dataclasses import dataclass

from kbot.kinematics.planar_pose import PlanarPose

_DRIVING = 0.05
"""m/s. A command above this must move the wheels."""
_MOVED = 1e-3
"""m. Less than this is not a motion."""
_WINDOW = 1.0
"""s. Time in which the motions by the wheels and by the scans are compared."""
_LEAST_WAY = 0.15
"""m. Shorter ways are not compared."""
_LEAST_SHARE = 0.3
"""Share of the wheels' way. A robot that moves less than this does not drive."""


@dataclass
class FaultWatch:
    """Compares the commands with the odometry, and the odometry with the scans.

    frozen    seconds of a command to drive after which the odometry must have changed
    lost      seconds after which scans that do not fit end the goal
    """

    frozen: float
    lost: float

    def __post_init__(self) -> None:
        self._drives_since: float | None = None
        self._drives_from = PlanarPose()
        self._misfit_since: float | None = None
        self._ways: deque[tuple[float, PlanarPose, PlanarPose]] = deque()

    def update(
        self, time: float, speed: float, wheels: PlanarPose, by_scans: PlanarPose, fits: bool | None
    ) -> str:
        """Why the robot must not drive on; empty if it may.

        `speed` is commanded, in m/s; `wheels` is the pose that the odometry reports, and `by_scans` that by
        matched scans. `fits` is whether the new scan fits the surroundings; None if none can be judged."""
        return (
            self._why_lost(time, fits)
            or self._why_frozen(time, speed, wheels)
            or self._why_lifted(time, wheels, by_scans)
        )

    def _why_lost(self, time: float, fits: bool | None) -> str:
        if fits is True:
            self._misfit_since = None
        elif fits is False and self._misfit_since is None:
            self._misfit_since = time
        if self._misfit_since is None or time - self._misfit_since < self.lost:
            return ""
        self._misfit_since = None
        return "the scans do not fit those before: the robot was moved, and its pose is unknown"

    def _why_frozen(self, time: float, speed: float, wheels: PlanarPose) -> str:
        moved = _distance(wheels, self._drives_from) > _MOVED
        if abs(speed) < _DRIVING or self._drives_since is None or moved:
            self._drives_since = time if abs(speed) >= _DRIVING else None
            self._drives_from = wheels
            return ""
        still = time - self._drives_since
        if still < self.frozen:
            return ""
        return f"the odometry reports no motion for {still:.1f} s although the robot is commanded to drive"

    def _why_lifted(self, time: float, wheels: PlanarPose, by_scans: PlanarPose) -> str:
        self._ways.append((time, wheels, by_scans))
        while self._ways[0][0] < time - _WINDOW:
            self._ways.popleft()
        _, first_wheels, first_by_scans = self._ways[0]
        way = _distance(wheels, first_wheels)
        if way < _LEAST_WAY or _distance(by_scans, first_by_scans) > _LEAST_SHARE * way:
            return ""
        return (
            f"the wheels report {way:.2f} m of motion, but the scans show that the robot does not move:"
            " it is lifted, blocked or slips"
        )


def _distance(a: PlanarPose, b: PlanarPose) -> float:
    return math.hypot(a.x - b.x, a.y - b.y)
