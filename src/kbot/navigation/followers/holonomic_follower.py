"""A controller that follows a path of poses with a base that drives in every direction."""

from __future__ import annotations

import math

import numpy as np

from kbot.kinematics.angles import wrap
from kbot.messages import Twist, Vector3
from kbot.navigation.controller import GENTLE, PLANNED_BRAKING, STILL, ControllerLimits, Observation
from kbot.navigation.path import Path
from kbot.text import KbotError

_GAIN = 4.0
"""1/s. The error of the pose decays with this rate; 1 is a tenth of the rate of the controller."""
_AHEAD = 0.1
"""Seconds by which the reference is ahead: about the lag of the drive."""
_STEP = 0.05
"""Seconds of the reference over which its speed is measured."""
_SLOWEST = 0.01
"""m/s or, times the turning length, rad/s. The lowest speed along the path."""
_RADIAN = 0.15
"""m. A turn by a radian counts as this much of the length of the path."""
_BEHIND = 0.05
"""m. A base that is further from its reference waits for it to be corrected."""


class HolonomicFollower:
    """Follows a path with headings. `is_done` is True once the base is at its end, and then stands still."""

    def __init__(self, path: Path, limits: ControllerLimits = GENTLE) -> None:
        """`limits.linear` holds in every direction. Raises KbotError: the path has no headings."""
        if path.yaws is None:
            raise KbotError(
                "a base that drives in every direction needs the heading at each point of its path"
            )
        self.path, self.limits = path, limits
        poses = np.column_stack([path.points, np.unwrap(path.yaws)])
        steps = np.diff(poses, axis=0)
        lengths = np.hypot(*steps[:, :2].T) + _RADIAN * np.abs(steps[:, 2])
        moves = lengths > 1e-9
        self._poses = poses[np.concatenate([[True], moves])]
        steps, lengths = steps[moves], lengths[moves]
        self._along = np.concatenate([[0.0], np.cumsum(lengths)])
        # the highest speed along each step at which neither driving nor turning is too fast
        distance, turn = np.hypot(*steps[:, :2].T), np.abs(steps[:, 2])
        needs = np.maximum(distance / limits.linear, turn / limits.angular)
        self._fastest = lengths / np.maximum(needs, 1e-9)
        self._place = 0.0
        self.is_done = False
        self.remaining = float(self._along[-1])
        """Length in m that is left along the path, with its turns."""
        self.heading_error = 0.0
        """Always 0: turns are part of the path."""

    def update(self, observation: Observation) -> Twist:
        if self.is_done:
            return STILL
        pose, limits = observation.pose, self.limits
        self._advance(pose.x, pose.y, pose.yaw)
        self.remaining = float(self._along[-1]) - self._place
        goal_x, goal_y, goal_yaw = self._poses[-1].tolist()
        off = math.hypot(goal_x - pose.x, goal_y - pose.y)
        turned = wrap(goal_yaw - pose.yaw)
        if off <= 0.5 * limits.distance and abs(turned) <= 0.5 * min(limits.angle, 1.0):
            self.is_done = observation.is_at_rest
            return STILL
        speed = self._speed()
        x, y, yaw = self._reference(self._place + speed * _AHEAD)
        at_x, at_y, at_yaw = self._reference(self._place)
        step = max(speed * _STEP, 1e-4)
        ahead = self._reference(self._place + step)
        span = min(step, max(self.remaining, 1e-9))
        drive = [speed * (b - a) / span for a, b in zip((at_x, at_y, at_yaw), ahead, strict=True)]
        error = x - pose.x, y - pose.y, wrap(yaw - pose.yaw)
        vx, vy, w = (d + _GAIN * (e - d * _AHEAD) for d, e in zip(drive, error, strict=True))
        cos, sin = math.cos(pose.yaw), math.sin(pose.yaw)
        return self._limited(cos * vx + sin * vy, cos * vy - sin * vx, w)

    def _limited(self, x: float, y: float, yaw: float) -> Twist:
        """The same motion, as fast as the limits allow."""
        share = min(
            1.0,
            self.limits.linear / max(math.hypot(x, y), 1e-9),
            self.limits.angular / max(abs(yaw), 1e-9),
        )
        return Twist(Vector3(x * share, y * share, 0.0), Vector3(0.0, 0.0, yaw * share))

    def _speed(self) -> float:
        """Along the path in m/s, turns included. It falls before slower steps and before the end."""
        at = min(int(np.searchsorted(self._along, self._place, side="right")) - 1, len(self._fastest) - 1)
        away = np.maximum(self._along[at:-1] - self._place, 0.0)
        bounds = np.sqrt(self._fastest[at:] ** 2 + 2.0 * self.limits.braking * away)
        end = math.sqrt(2.0 * PLANNED_BRAKING * self.limits.braking * max(self.remaining, 0.0))
        return max(min(float(bounds.min()), end), _SLOWEST if self.remaining > 0.0 else 0.0)

    def _advance(self, x: float, y: float, yaw: float) -> None:
        """Find the nearest place of the path, never backwards."""
        first = max(int(np.searchsorted(self._along, self._place, side="right")) - 1, 0)
        reach = self._place + 3.0 * _BEHIND
        last = min(int(np.searchsorted(self._along, reach)) + 1, len(self._along))
        scale = np.array([1.0, 1.0, _RADIAN])
        points = self._poses[first:last] * scale
        if len(points) < 2:
            return
        full = 2.0 * math.pi * round((self._poses[first, 2] - yaw) / (2.0 * math.pi))
        here = np.array([x, y, yaw + full]) * scale
        ways = np.diff(points, axis=0)
        share = np.clip(((here - points[:-1]) * ways).sum(axis=1) / (ways**2).sum(axis=1), 0.0, 1.0)
        off = np.linalg.norm(points[:-1] + share[:, None] * ways - here, axis=1)
        best = int(off.argmin())
        steps = np.diff(self._along[first:last])
        self._place = max(self._place, float(self._along[first + best] + share[best] * steps[best]))

    def _reference(self, along: float) -> tuple[float, float, float]:
        """The pose of the path at a length in m."""
        x, y, yaw = (float(np.interp(along, self._along, self._poses[:, column])) for column in range(3))
        return x, y, yaw
