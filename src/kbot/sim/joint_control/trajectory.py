"""Interpolates joint trajectories as joint_trajectory_controller does, and checks joint commands.

With positions alone it goes straight, with velocities along cubics, with accelerations along quintics
(its own `Trajectory::interpolate_between_points`).
"""

from __future__ import annotations

import reprlib
from bisect import bisect_right
from collections.abc import Mapping, Sequence
from itertools import pairwise
from typing import Any, NamedTuple, TypeGuard

import numpy as np
from numpy.typing import NDArray

from kbot.sim.joint_control.kinds import Interface
from kbot.sim.numbers import FURTHEST, is_within
from kbot.text import KbotError
from kbot.text.suggest import did_you_mean

Array = NDArray[np.float64]


class TrajectoryPoint(NamedTuple):
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

    def __init__(self, start: TrajectoryPoint, points: Sequence[TrajectoryPoint]) -> None:
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


def _between(a: TrajectoryPoint, b: TrajectoryPoint, time: float) -> Sample:
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


MOST_POINTS = 100_000
"""A quarter of an hour at 100 Hz: a second of work, for which the run stands."""


def joint_command(values: object, interface: str) -> tuple[dict[str, float], Interface]:
    """Raises KbotError for what is no mapping of joints, or an interface that joints do not have."""
    if not isinstance(values, Mapping):
        raise KbotError(f"joints are commanded by name, as in {{'arm': 0.5}}, not {reprlib.repr(values)}")
    for name, value in values.items():
        if isinstance(value, bool):
            raise KbotError(f"joint '{name}' is told a number, not {value}")
    try:
        return dict(values), Interface(interface)
    except ValueError:
        hint = did_you_mean(str(interface), list(Interface)) or f"there are {', '.join(Interface)}"
        raise KbotError(f"joints have no interface {reprlib.repr(interface)}: {hint}") from None


def trajectory_points(joints: object, points: object) -> tuple[tuple[str, ...], tuple[TrajectoryPoint, ...]]:
    """Raises KbotError for points that are none, or whose times do not grow."""
    if isinstance(joints, str) or not isinstance(joints, Sequence) or not isinstance(points, Sequence):
        raise KbotError("a trajectory is a list of joints and a list of points")
    if len(points) > MOST_POINTS:
        raise KbotError(
            f"a trajectory has at most {MOST_POINTS:,} points, not {len(points):,}: give it in parts"
        )
    names = tuple(joints)
    if not names or not all(isinstance(name, str) for name in names) or len(set(names)) < len(names):
        raise KbotError(f"the joints of a trajectory are names, each once, not {reprlib.repr(joints)}")
    made = tuple(_point(point, len(names)) for point in points)
    for before, after in pairwise(made):
        if not after.time > before.time:
            raise KbotError(
                f"the times of a trajectory grow: {after.time:g} s does not follow {before.time:g} s"
            )
    return names, made


def _point(point: object, count: int) -> TrajectoryPoint:
    if not _is_list(point) or not 2 <= len(point) <= 4:
        raise KbotError(f"a point is a time, positions, and if wanted velocities, not {reprlib.repr(point)}")
    time, *lists = point
    if not _is_sound(time) or time < 0.0:
        raise KbotError(f"the time of a point is a number of seconds from 0 on, not {reprlib.repr(time)}")
    for index, values in enumerate(lists):
        if not _is_list(values):
            raise KbotError(f"a point has lists of numbers, not {reprlib.repr(values)}")
        if len(values) != count and (index == 0 or len(values)):
            raise KbotError(f"a point has {count} numbers, one a joint, not {len(values)}")
        if not all(map(_is_sound, values)):
            raise KbotError(f"a point is made of finite numbers, not {reprlib.repr(values)}")
    return TrajectoryPoint(float(time), *(tuple(map(float, values)) for values in lists))


def _is_list(value: object) -> TypeGuard[Sequence[Any]]:  # Any: its values are checked one by one
    # what nearly all are first: an abstract class is asked a hundred times as slowly
    return isinstance(value, tuple | list) or (isinstance(value, Sequence) and not isinstance(value, str))


def _is_sound(value: object) -> TypeGuard[float]:
    return -FURTHEST <= value <= FURTHEST if type(value) is float else is_within(value, FURTHEST)
