"""Watches when a robot's true position comes within the arrival radius of a goal."""

from __future__ import annotations

import math

from kbot.kinematics.planar_pose import PlanarPose
from kbot.sim import Simulation

_RATE = 100.0
_DEPARTED = 0.1
"""m of movement at which the time begins, as in the BARN challenge. Planning before that does not count."""


class ArrivalWatch:
    """Watches a simulation's first robot until it is closed.

    `time` is the seconds from 0.1 m of movement to the first true entry, None before it."""

    def __init__(self, simulation: Simulation, goal: PlanarPose, radius: float) -> None:
        """`radius` in m."""
        self._simulation, self._goal, self._radius = simulation, goal, radius
        self._start = simulation.ground_truth.pose
        self._departed: float | None = None
        self.time: float | None = None
        self._timer = simulation.clock.every(_RATE, self._look)
        self._look()

    def close(self) -> None:
        """Stop watching."""
        self._look()
        self._timer.cancel()

    def _look(self) -> None:
        pose, now = self._simulation.ground_truth.pose, self._simulation.time
        away = math.hypot(pose.x - self._start.x, pose.y - self._start.y)
        if self._departed is None and away >= _DEPARTED:
            self._departed = now
        off = math.hypot(pose.x - self._goal.x, pose.y - self._goal.y)
        if self.time is None and off <= self._radius:
            self.time = 0.0 if self._departed is None else now - self._departed
