"""How bases move in a search over position and heading: with a least turning radius, or in every
direction."""

from __future__ import annotations

import math
from collections.abc import Iterator
from itertools import product

import numpy as np
from numpy.typing import NDArray

from kbot.kinematics.angles import wrap, wrap_all
from kbot.kinematics.planar_pose import PlanarPose
from kbot.navigation.planning.reeds_shepp import along_arc, distances, path_between

Values = NDArray[np.float64]

ORIGIN = PlanarPose()
_HEADINGS = 16
"""Headings that are tried at a goal whose heading is free."""
_WORDS = 8
"""Reeds-Shepp words that are tried between two poses."""
_LONGEST = 2.0
"""A word is tried if it is at most this many times as long as the shortest, or a turning radius longer."""


class SteeredMoves:
    """A base with a least turning radius, which drives forwards and backwards. The moving point is the middle
    of its fixed axle."""

    def __init__(self, radius: float, cell: float, spacing: float, point: PlanarPose = ORIGIN) -> None:
        """In m: the least turning radius, the size of the search's cells, and the distance between the poses
        of a path. `point` is the moving point in the frame of the base, whose position a goal with a free
        heading gives."""
        self.radius, self._spacing, self._point = radius, spacing, point
        angle = 2.0 * math.pi / 72
        # each step must leave its cell, and its sharpest curve the cell of its heading
        length = max(1.5 * cell, 1.1 * angle * radius)
        count = max(2, math.ceil(length / (2.0 * spacing)))
        curvatures = [share / radius for share in (-1.0, -0.5, 0.0, 0.5, 1.0)]
        ways = [
            (way, along_arc(PlanarPose(), curvature, way * length * np.arange(1, count + 1) / count))
            for way, curvature in product((1.0, -1.0), curvatures)
        ]
        self.steps = np.stack([poses for _, poses in ways])
        self.directions = np.array([way for way, _ in ways])
        self.lengths = np.full(len(ways), length)
        self.cusp = 0.1 * radius
        self.cell = cell, angle

    def estimate(self, poses: Values, goal: PlanarPose, any_heading: bool) -> Values:
        """The lengths of the Reeds-Shepp paths, or of straight lines if the heading is free."""
        x, y = goal.x - poses[:, 0], goal.y - poses[:, 1]
        if any_heading:
            away: Values = np.hypot(x, y)
            return np.maximum(away - 2.0 * math.hypot(self._point.x, self._point.y), 0.0)
        cos, sin = np.cos(poses[:, 2]), np.sin(poses[:, 2])
        ahead, left = (cos * x + sin * y) / self.radius, (cos * y - sin * x) / self.radius
        return self.radius * distances(ahead, left, goal.yaw - poses[:, 2])

    def connections(
        self, start: PlanarPose, goal: PlanarPose, any_heading: bool, most: float
    ) -> Iterator[Values]:
        """Reeds-Shepp paths, the shortest first."""
        goals = [goal]
        if any_heading:
            place = goal @ self._point.inverse()
            towards = math.atan2(place.y - start.y, place.x - start.x)
            yaws = [towards + turn * (2.0 * math.pi / _HEADINGS) for turn in range(_HEADINGS)]
            goals = [PlanarPose(place.x, place.y, yaw) @ self._point for yaw in [start.yaw, *yaws]]
            x, y = start.local(*np.array([(end.x, end.y) for end in goals]).T)
            turns = np.array([end.yaw for end in goals]) - start.yaw
            lengths = distances(x / self.radius, y / self.radius, turns)
            goals = [goals[at] for at in np.argsort(lengths)[: _WORDS // 2]]
        words = [
            (path.length * self.radius + path.cusps * self.cusp, index, path)
            for index, end in enumerate(goals)
            for path in path_between(start, end, self.radius)[: _WORDS if len(goals) == 1 else 2]
        ]
        words.sort(key=lambda word: word[0])
        for cost, _, path in words:
            if cost >= most or cost > _LONGEST * words[0][0] + self.radius:
                break
            yield path.sample(start, self.radius, self._spacing)

    def costs(self, poses: Values) -> tuple[Values, Values]:
        """The lengths of the arcs, and whether they are driven forwards (1) or backwards (-1)."""
        x, y, turn = _steps(poses)
        middle = poses[:-1, 2] + turn / 2.0
        ahead = x * np.cos(middle) + y * np.sin(middle)
        return np.hypot(x, y) / np.sinc(turn / (2.0 * math.pi)), np.where(ahead < 0.0, -1.0, 1.0)


class HolonomicMoves:
    """A base that drives in every direction, with any heading."""

    def __init__(self, cell: float, spacing: float, turning: float) -> None:
        """In m: the size of the search's cells, the distance between the poses of a path, and the distance
        that a turn by a radian counts for."""
        self._spacing, self._turning = spacing, turning
        self.directions = np.zeros(0)
        angle = 2.0 * math.pi / 36
        count = max(2, math.ceil(1.5 * cell / (2.0 * spacing)))
        share = np.arange(1, count + 1)[:, None] / count
        # eight ways, each also with a turn, and turns on the spot
        ways = [
            (1.5 * cell * math.cos(at), 1.5 * cell * math.sin(at), turn)
            for at, turn in product(np.arange(8) * (math.pi / 4.0), (-angle, 0.0, angle))
        ]
        ends = np.array([*ways, (0.0, 0.0, -angle), (0.0, 0.0, angle)])
        self.steps = share * ends[:, None]
        self.lengths = np.hypot(ends[:, 0], ends[:, 1]) + turning * np.abs(ends[:, 2])
        self.directions = np.zeros(len(ends))
        self.cusp = 0.0
        self.cell = cell, angle

    def estimate(self, poses: Values, goal: PlanarPose, any_heading: bool) -> Values:
        """The straight lines, with their turns."""
        straight = np.hypot(goal.x - poses[:, 0], goal.y - poses[:, 1])
        if any_heading:
            return straight
        turn = wrap_all(goal.yaw - poses[:, 2])
        with_turn: Values = straight + self._turning * np.abs(turn)
        return with_turn

    def connections(
        self, start: PlanarPose, goal: PlanarPose, any_heading: bool, most: float
    ) -> Iterator[Values]:
        """A straight line on which the heading changes steadily, and those that turn before or after it."""
        turn = 0.0 if any_heading else wrap(goal.yaw - start.yaw)
        length = math.hypot(goal.x - start.x, goal.y - start.y)
        if length + self._turning * abs(turn) >= most:
            return
        count = max(1, math.ceil(max(length, self._turning * abs(turn)) / self._spacing))
        even = np.linspace(0.0, 1.0, count + 1)
        turns = [even]
        if turn:
            early, late = np.minimum(2.0 * even, 1.0), np.maximum(2.0 * even - 1.0, 0.0)
            turns += [early, late]
        for share in turns:
            yield np.column_stack(
                [
                    start.x + (goal.x - start.x) * even,
                    start.y + (goal.y - start.y) * even,
                    start.yaw + turn * share,
                ]
            )

    def costs(self, poses: Values) -> tuple[Values, Values]:
        """The lengths, with their turns."""
        x, y, turn = _steps(poses)
        return np.hypot(x, y) + self._turning * np.abs(turn), np.zeros(len(x))


def _steps(poses: Values) -> tuple[Values, Values, Values]:
    """The changes of x, y and heading between each two poses."""
    x, y, turn = np.diff(poses, axis=0).T
    return x, y, wrap_all(turn)
