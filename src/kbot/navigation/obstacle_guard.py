"""Stops the robot before obstacles that a lidar sees, whatever its controller commands."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from kbot.kinematics.planar_pose import arc
from kbot.messages import Twist
from kbot.navigation.controller import STILL, Controller, Observation, twist
from kbot.navigation.footprint import Outline


class ObstacleGuard:
    """Wraps a controller and slows or stops it where its arc would lead into what the lidar saw.

    `blocked_since` is when it began to hold the robot back, `silent_since` when the lidar fell silent;
    None where neither is so.
    """

    def __init__(
        self,
        controller: Controller,
        outline: Outline,
        margin: float = 0.01,
        braking: float = 0.6,
        silence: float = 0.5,
    ) -> None:
        """`margin` in m is kept beside the outline; `braking` in m/s^2 is how hard it brakes; a lidar that
        said nothing for `silence` seconds stops the robot."""
        self.controller, self.outline = controller, outline
        self.margin, self.braking, self.silence = margin, braking, silence
        self.blocked_since: float | None = None
        self.silent_since: float | None = None
        self._near = outline.grown(margin)
        self._reach = self._near.reach

    def update(self, observation: Observation) -> Twist:
        return self.guard(observation, self.controller.update(observation))

    def guard(self, observation: Observation, wanted: Twist) -> Twist:
        """The twist that may be driven in place of the one wanted."""
        if observation.obstacles is None or observation.obstacles_age > self.silence:
            if self.silent_since is None:
                self.silent_since = observation.time
            return STILL
        self.silent_since = None
        v, w = wanted.linear.x, wanted.angular.z
        share = self._allowed(observation.obstacles, v, w) if v or w else 1.0
        if share >= 0.05 or not (v or w):
            self.blocked_since = None
        elif self.blocked_since is None:
            self.blocked_since = observation.time
        return twist(v * share, w * share) if share >= 0.05 else STILL

    def _allowed(self, points: NDArray[np.float64], v: float, w: float) -> float:
        """The share of a twist from which the robot still stops before the first point on its arc."""
        points = points[~self.outline.holds(points)]
        horizon = abs(v) / self.braking + 0.2
        speed = abs(v) + abs(w) * self._reach
        near = points[np.hypot(points[:, 0], points[:, 1]) < self._reach + speed * horizon]
        if not len(near):
            return 1.0
        inside = self._near.holds(near)
        steps = max(2, math.ceil(speed * horizon / 0.02))
        for step in range(1, steps + 1):
            time = horizon * step / steps
            pose = arc(v * time, w * time)
            moved = np.stack(pose.local(near[:, 0], near[:, 1]), axis=1)
            hit = self._near.holds(moved)
            # a point within the margin does not hold the robot back from leaving it
            if inside.any():
                hit &= ~inside | self._deeper(moved, near)
            if hit.any():
                free = horizon * (step - 1) / steps * abs(v)
                return min(1.0, math.sqrt(2.0 * self.braking * free) / abs(v)) if v else 0.0
        return 1.0

    def _deeper(self, moved: NDArray[np.float64], before: NDArray[np.float64]) -> NDArray[np.bool_]:
        """Which points come nearer to the middle of the outline."""
        away, was = (np.hypot(*(p - self.outline.middle).T) for p in (moved, before))
        nearer: NDArray[np.bool_] = away < was - 1e-4
        return nearer
