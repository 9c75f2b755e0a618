"""A way of several joints through time, as joint_trajectory_controller goes between its points.

With positions alone it goes straight, with velocities along cubics, with accelerations along quintics
(its own `Trajectory::interpolate_between_points`).
"""

from __future__ import annotations

from bisect import bisect_right
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


class Point(NamedTuple):
    """Seconds from the start, and a number a joint: rad or m, and their derivatives where they are given."""

    time: float
    positions: tuple[float, ...]
    velocities: tuple[float, ...] = ()
    accelerations: tuple[float, ...] = ()


class Sample(NamedTuple):
    """Positions, velocities and accelerations (n,) of all joints."""

    positions: Array
    velocities: Array
    accelerations: Array


class Trajectory:
    """Goes from `start`, which is where the joints are at time 0, through `points` in the order of time."""

    def __init__(self, start: Point, points: Sequence[Point]) -> None:
        self._points = [start, *points]

    @property
    def end(self) -> float:
        """Seconds."""
        return self._points[-1].time

    def at(self, time: float) -> Sample:
        """Where the joints are to be at a time (s); at rest at the last point from the end on."""
        last = self._points[-1]
        if time >= last.time:
            still = np.zeros(len(last.positions))
            return Sample(np.array(last.positions), still, still)
        after = bisect_right(self._points, time, key=lambda point: point.time)
        return _between(self._points[after - 1], self._points[after], time)


def _between(a: Point, b: Point, time: float) -> Sample:
    """On the polynomial of the least degree that has what both points give."""
    length, t = b.time - a.time, time - a.time
    p, q = np.array(a.positions), np.array(b.positions)
    if not b.velocities:
        slope = (q - p) / length
        return Sample(p + slope * t, slope, np.zeros(len(p)))
    v = np.array(a.velocities or (0.0,) * len(p))
    w = np.array(b.velocities)
    if not b.accelerations:
        two = (3.0 * (q - p) / length - 2.0 * v - w) / length
        three = (2.0 * (p - q) / length + v + w) / length**2
        return _sample((p, v, two, three), t)
    c, d = np.array(a.accelerations or (0.0,) * len(p)), np.array(b.accelerations)
    way = q - p - v * length - c * length**2 / 2.0
    speed = w - v - c * length
    turn = d - c
    three = (10.0 * way / length - 4.0 * speed + turn * length / 2.0) / length**2
    four = (-15.0 * way / length + 7.0 * speed - turn * length) / length**3
    five = (6.0 * way / length - 3.0 * speed + turn * length / 2.0) / length**4
    return _sample((p, v, c / 2.0, three, four, five), t)


def _sample(coefficients: tuple[Array, ...], t: float) -> Sample:
    """A polynomial and its derivatives."""
    zero = np.zeros_like(coefficients[0])
    position = sum((k * t**n for n, k in enumerate(coefficients)), zero)
    velocity = sum((n * k * t ** (n - 1) for n, k in enumerate(coefficients) if n), zero)
    acceleration = sum((n * (n - 1) * k * t ** (n - 2) for n, k in enumerate(coefficients) if n > 1), zero)
    return Sample(position, velocity, acceleration)
