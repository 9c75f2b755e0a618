"""A controller around another one that stops the robot before obstacles that a lidar detects."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from kbot.brief import Brief
from kbot.kinematics.planar_pose import PlanarPose, arc
from kbot.messages import Twist, Vector3
from kbot.navigation.controller import STILL, Controller, Observation, required_rate, top_speeds
from kbot.navigation.space.footprint import Outline

_LEAST_SHARE = 0.05
"""A command that must be reduced to less than this share counts as blocked, and the robot stops."""
_STEP = 0.02
"""m. The arc ahead is checked at points that are at most this far apart, for every point of the robot."""
_REACTION = 0.2
"""Seconds that the checked time exceeds the time to brake."""


class ObstacleGuard(Brief):
    """Wraps a controller, and slows or stops the robot if its arc leads into an obstacle.

    `blocked_since` is the time since which it stops the robot, and `silent_since` the time since which the
    lidar is silent. Both are None otherwise.
    """

    def __init__(
        self,
        controller: Controller,
        outline: Outline,
        margin: float = 0.01,
        braking: float = 0.6,
        silence: float = 0.5,
    ) -> None:
        """Guard a controller.

        Args:
            controller: computes the commands.
            outline: of the robot.
            margin: distance in m to keep around the outline.
            braking: deceleration of the robot in m/s^2.
            silence: seconds without a scan after which the robot is stopped.
        """
        self.controller, self.outline = controller, outline
        self.margin, self.braking, self.silence = margin, braking, silence
        self.required_rate = required_rate(controller)
        self.top_speeds = top_speeds(controller)
        self.blocked_since: float | None = None
        self.silent_since: float | None = None
        self._near = outline.grown(margin)
        self._reach = self._near.reach

    def update(self, observation: Observation) -> Twist:
        return self.guard(observation, self.controller.update(observation))

    def guard(self, observation: Observation, wanted: Twist) -> Twist:
        """The wanted twist, reduced or zero if the robot could not stop before an obstacle."""
        if observation.obstacles is None or observation.obstacles_age > self.silence:
            if self.silent_since is None:
                self.silent_since = observation.time
            return STILL
        self.silent_since = None
        v, u, w = wanted.linear.x, wanted.linear.y, wanted.angular.z
        # a robot that drives sideways drives an arc in this direction of its base
        way = PlanarPose(0.0, 0.0, math.atan2(u, v)) if u else PlanarPose()
        speed = math.hypot(v, u) if u else v
        share = self._allowed(observation.obstacles, way, speed, w) if speed or w else 1.0
        if share >= _LEAST_SHARE or not (speed or w):
            self.blocked_since = None
        elif self.blocked_since is None:
            self.blocked_since = observation.time
        if share < _LEAST_SHARE:
            return STILL
        return Twist(Vector3(v * share, u * share, 0.0), Vector3(0.0, 0.0, w * share))

    def _allowed(self, points: NDArray[np.float64], way: PlanarPose, v: float, w: float) -> float:
        """The share of a twist from which the robot still stops before the first point on its arc."""
        back = way.inverse()
        points = points[~self.outline.holds(points)]
        horizon = abs(v) / self.braking + _REACTION
        speed = abs(v) + abs(w) * self._reach
        near = points[np.hypot(points[:, 0], points[:, 1]) < self._reach + speed * horizon]
        if not len(near):
            return 1.0
        inside = self._near.holds(near)
        steps = max(2, math.ceil(speed * horizon / _STEP))
        for step in range(1, steps + 1):
            time = horizon * step / steps
            pose = way @ arc(v * time, w * time) @ back
            moved = np.stack(pose.local(near[:, 0], near[:, 1]), axis=1)
            hit = self._near.holds(moved)
            # a point that is already within the margin must not keep the robot from driving away from it
            if inside.any():
                hit &= ~inside | self._deeper(moved, near)
            if hit.any():
                free = horizon * (step - 1) / steps * abs(v)
                return min(1.0, math.sqrt(2.0 * self.braking * free) / abs(v)) if v else 0.0
        return 1.0

    def _deeper(self, moved: NDArray[np.float64], before: NDArray[np.float64]) -> NDArray[np.bool_]:
        """Which points come nearer to the middle of the outline."""
        now, earlier = (np.hypot(*(p - self.outline.middle).T) for p in (moved, before))
        nearer: NDArray[np.bool_] = now < earlier - 1e-4
        return nearer
