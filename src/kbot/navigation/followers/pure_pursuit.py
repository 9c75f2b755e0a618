"""Controllers that follow a path by steering to a point ahead on it (pure pursuit).

R. C. Coulter, "Implementation of the pure pursuit path tracking algorithm", CMU-RI-TR-92-01: the arc
through a point at (x, y) in the robot's frame has the curvature 2 y / (x^2 + y^2). Regulation as in
S. Macenski et al., "Regulated pure pursuit for robot path tracking", Autonomous Robots 47 (2023): the robot
slows in tight curves, near obstacles and before the end.
"""

from __future__ import annotations

import math

import numpy as np

from kbot.brief import Brief
from kbot.kinematics.angles import wrap
from kbot.messages import Twist
from kbot.navigation.controller import GENTLE, STILL, ControllerLimits, Observation, same_side, twist
from kbot.navigation.path import Path
from kbot.text import KbotError

_TURN_FIRST = math.radians(50)
"""With a larger bearing to the point ahead, the robot stops driving and turns on the spot."""
_AIMED = math.radians(10)
"""The bearing at which it drives again. It is smaller, so that the robot does not alternate between both."""


class PurePursuit(Brief):
    """Follows a path at constant speed, then turns to the path's last heading. `is_done` is then True."""

    def __init__(self, path: Path, limits: ControllerLimits = GENTLE, lookahead: float = 0.15) -> None:
        """`lookahead` is a distance in m. Raises KbotError if it is not above 0."""
        if not (math.isfinite(lookahead) and lookahead > 0.0):
            raise KbotError(f"lookahead must be a distance above 0 m, not {lookahead}")
        self.path, self.limits, self.lookahead = path, limits, lookahead
        self.is_done = False
        self.remaining = path.length
        """Distance in m that is left along the path."""
        self.heading_error = 0.0
        """Angle in rad that is left to turn on the spot."""
        pieces = np.diff(path.points, axis=0)
        lengths = np.hypot(*pieces.T)
        self._points: list[list[float]] = path.points.tolist()
        self._lengths: list[float] = lengths.tolist()
        self._beyond: list[float] = np.append(np.cumsum(lengths[::-1])[::-1], 0.0)[1:].tolist()
        self._piece = 0
        self._along = 0.0
        self._turning = True
        self._arrived = False

    def update(self, observation: Observation) -> Twist:
        if self.is_done:
            return STILL
        self._advance(observation.pose.x, observation.pose.y)
        goal_x, goal_y = observation.in_base(*self.path.goal)
        to_goal = math.hypot(goal_x, goal_y)
        if self._arrived or self._is_there(goal_x, to_goal):
            self._arrived = True
            return self._finish(observation)
        x, y = observation.in_base(*self._ahead(self._lookahead_at(observation)))
        bearing = same_side(math.atan2(y, x), self.heading_error)
        self._turning = abs(bearing) > (_AIMED if self._turning else _TURN_FIRST)
        self.heading_error = bearing if self._turning else 0.0
        if self._turning:
            return twist(0.0, self.limits.turn_to(bearing))
        curvature = 2.0 * y / max(x * x + y * y, 1e-9)
        speed = min(self._speed(curvature, observation), self.limits.speed_to_stop_in(self.remaining))
        speed = max(speed, 0.02)
        if abs(curvature) * speed > self.limits.angular:
            speed = self.limits.angular / abs(curvature)
        return twist(speed, speed * curvature)

    def _speed(self, curvature: float, observation: Observation) -> float:
        """Speed in m/s for a curvature in 1/m, regardless of the end of the path."""
        return self.limits.linear

    def _lookahead_at(self, observation: Observation) -> float:
        return self.lookahead

    def _is_there(self, ahead: float, distance: float) -> bool:
        """Whether the robot is at the goal, or just past it at the end of the path."""
        near = self.limits.distance
        return distance <= near or (self.remaining <= near and ahead <= 0.0 and distance <= 5.0 * near)

    def _finish(self, observation: Observation) -> Twist:
        yaw = self.path.yaw
        off = 0.0 if yaw is None else wrap(yaw - observation.pose.yaw)
        self.remaining, self.heading_error = 0.0, off
        if abs(off) <= self.limits.angle:
            self.is_done = True
            return STILL
        return twist(0.0, self.limits.turn_to(off))

    def _advance(self, x: float, y: float) -> None:
        """Find the nearest place on the path, never backwards and at most two lookahead distances ahead: a
        path may pass close to itself."""
        best, reach, at = math.inf, 2.0 * self.lookahead, self._piece
        place = self._piece, self._along
        while at < len(self._lengths):
            (ax, ay), (bx, by), length = self._points[at], self._points[at + 1], self._lengths[at]
            along = 0.0
            if length > 0.0:
                along = ((x - ax) * (bx - ax) + (y - ay) * (by - ay)) / length
            along = min(max(along, self._along if at == self._piece else 0.0), length)
            share = along / length if length > 0.0 else 0.0
            off = math.hypot(ax + share * (bx - ax) - x, ay + share * (by - ay) - y)
            if off < best - 1e-9:
                best, place = off, (at, along)
            reach -= length - (self._along if at == self._piece else 0.0)
            if reach <= 0.0:
                break
            at += 1
        self._piece, self._along = place
        if self._lengths:
            self.remaining = self._beyond[self._piece] + self._lengths[self._piece] - self._along

    def _ahead(self, distance: float) -> tuple[float, float]:
        """The point at a distance in m ahead on the path, or the end of the path."""
        at, along = self._piece, self._along + distance
        while at < len(self._lengths) and along > self._lengths[at]:
            along -= self._lengths[at]
            at += 1
        if at >= len(self._lengths):
            return self.path.goal
        (ax, ay), (bx, by), length = self._points[at], self._points[at + 1], self._lengths[at]
        share = along / length if length > 0.0 else 0.0
        return ax + share * (bx - ax), ay + share * (by - ay)


class RegulatedPurePursuit(PurePursuit):
    """Pure pursuit that looks further ahead at higher speed, and slows in curves and near obstacles."""

    def __init__(
        self,
        path: Path,
        limits: ControllerLimits = GENTLE,
        lookahead: float = 0.15,
        lookahead_time: float = 0.5,
        least_radius: float = 0.3,
        least_speed: float = 0.06,
        proximity: float = 0.0,
    ) -> None:
        """Follow a path with regulated speed.

        Args:
            path: to follow.
            limits: of speed and braking.
            lookahead: the largest lookahead distance in m; half of it is the smallest.
            lookahead_time: the lookahead distance in seconds of the current speed.
            least_radius: curves with a smaller radius in m are driven more slowly.
            least_speed: the lowest speed in curves and near obstacles, in m/s.
            proximity: distance in m from the base's origin within which obstacles slow the robot in
                proportion; 0 for never.
        """
        super().__init__(path, limits, lookahead)
        self.lookahead_time, self.least_radius = lookahead_time, least_radius
        self.least_speed, self.proximity = least_speed, proximity

    def _lookahead_at(self, observation: Observation) -> float:
        return min(self.lookahead, max(self.lookahead / 2.0, abs(observation.twist.x) * self.lookahead_time))

    def _speed(self, curvature: float, observation: Observation) -> float:
        speed = self.limits.linear
        if abs(curvature) * self.least_radius > 1.0:
            speed /= abs(curvature) * self.least_radius
        points = observation.obstacles
        if self.proximity > 0.0 and points is not None and len(points):
            nearest = math.sqrt(float((points * points).sum(axis=1).min()))
            speed *= min(1.0, nearest / self.proximity)
        return max(speed, min(self.least_speed, self.limits.linear))
