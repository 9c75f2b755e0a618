"""The paths of a robot on the timeline, one per reset, which are drawn as its trail."""

from __future__ import annotations

import math
from bisect import bisect_right
from collections import deque
from dataclasses import dataclass, field
from typing import NamedTuple

MOST_POINTS = 8000
"""Points of one path. When there are more, the older half is deleted."""


class TrailPoint(NamedTuple):
    """A point of the path: the time in s on the timeline, and x and y in m of the world.

    `is_jump` means that the robot was moved there and did not drive from the previous point.
    """

    at: float
    x: float
    y: float
    is_jump: bool = False


@dataclass(slots=True)
class DrivenPath:
    """The path since the simulation was reset or set back `resets` times."""

    resets: int
    began: float
    points: list[TrailPoint] = field(default_factory=list)

    def add(self, at: float, x: float, y: float, spacing: float, is_jump: bool) -> None:
        """Add the robot's position. Skip it if it is nearer to the last one than `spacing` in m."""
        if self.points and math.hypot(x - self.points[-1].x, y - self.points[-1].y) < spacing:
            return
        self.points.append(TrailPoint(round(at, 4), round(x, 4), round(y, 4), is_jump and bool(self.points)))
        if len(self.points) > MOST_POINTS:
            del self.points[: MOST_POINTS // 2]

    def until(self, at: float) -> list[TrailPoint]:
        """Return the points until a time."""
        return self.points[: bisect_right(self.points, at, key=lambda point: point.at)]


class DrivenPaths:
    """The newest path, and the earlier ones that are within the kept time."""

    def __init__(self) -> None:
        self._all: deque[DrivenPath] = deque()
        self._jumps = 0
        self._before: list[TrailPoint] = []
        """The path to the state from which the simulation continues next."""

    def continue_from(self, at: float) -> None:
        """Start the next path with the one that led to a time."""
        led = [way for way in self._all if way.began <= at]
        self._before = led[-1].until(at) if led else []

    def add(self, resets: int, at: float, x: float, y: float, spacing: float, jumps: int) -> None:
        """Add a position to the path since `resets`. `jumps` counts how often the robot was moved."""
        if not self._all or self._all[-1].resets != resets:
            self._all.append(DrivenPath(resets, at, self._before))
            self._before = []
        self._all[-1].add(at, x, y, spacing, jumps != self._jumps)
        self._jumps = jumps

    def forget(self, start: float) -> None:
        """Delete paths that ended before `start`."""
        while len(self._all) > 1 and self._all[1].began < start:
            self._all.popleft()

    def of(self, resets: int) -> list[TrailPoint]:
        """Return the path since `resets`, or an empty list."""
        return next((way.points for way in self._all if way.resets == resets), [])
