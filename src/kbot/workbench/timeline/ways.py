"""The paths of a robot over the timeline, one up to each reset, drawn as its trail."""

from __future__ import annotations

import math
from bisect import bisect_right
from collections import deque
from dataclasses import dataclass, field
from typing import NamedTuple

MOST_POINTS = 8000
"""Of one way; of a longer one the older half is forgotten."""


class TrailPoint(NamedTuple):
    """When the robot came there, in s along the timeline, and x and y in m of the world; with `is_jump` it
    did not drive there from the point before, but was put there."""

    at: float
    x: float
    y: float
    is_jump: bool = False


@dataclass(slots=True)
class Way:
    """The way since the simulation was reset or set back so many times."""

    resets: int
    began: float
    points: list[TrailPoint] = field(default_factory=list)

    def add(self, at: float, x: float, y: float, spacing: float, is_jump: bool) -> None:
        """The robot is at a place; one nearer to the last than `spacing`, in m, is passed over."""
        if self.points and math.hypot(x - self.points[-1].x, y - self.points[-1].y) < spacing:
            return
        self.points.append(TrailPoint(round(at, 4), round(x, 4), round(y, 4), is_jump and bool(self.points)))
        if len(self.points) > MOST_POINTS:
            del self.points[: MOST_POINTS // 2]

    def until(self, at: float) -> list[TrailPoint]:
        """What of it was gone by a moment."""
        return self.points[: bisect_right(self.points, at, key=lambda point: point.at)]


class Ways:
    """The newest, and those before it that began or were gone on within what is kept."""

    def __init__(self) -> None:
        self._all: deque[Way] = deque()
        self._jumps = 0
        self._before: list[TrailPoint] = []
        """The way to the state that the simulation goes on from next."""

    def go_on_from(self, at: float) -> None:
        """The next way begins with the one that led to a moment."""
        led = [way for way in self._all if way.began <= at]
        self._before = led[-1].until(at) if led else []

    def add(self, resets: int, at: float, x: float, y: float, spacing: float, jumps: int) -> None:
        """As of a way, of the one since so many resets; the robot was put elsewhere so many times."""
        if not self._all or self._all[-1].resets != resets:
            self._all.append(Way(resets, at, self._before))
            self._before = []
        self._all[-1].add(at, x, y, spacing, jumps != self._jumps)
        self._jumps = jumps

    def forget(self, start: float) -> None:
        """Only moments from `start` on are looked at any more."""
        while len(self._all) > 1 and self._all[1].began < start:
            self._all.popleft()

    def of(self, resets: int) -> list[TrailPoint]:
        """The way since so many resets, empty where it is not known."""
        return next((way.points for way in self._all if way.resets == resets), [])
