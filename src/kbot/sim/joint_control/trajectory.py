"""Interpolates joint trajectories as joint_trajectory_controller does, and checks joint commands.

Interpolation is linear for positions alone, cubic with velocities, and quintic with accelerations, as in that
controller's `Trajectory::interpolate_between_points`.
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
    """A point of a trajectory: `time` in s from the start, and one number per joint (rad or m).

    Velocities and accelerations may be empty.
    """

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
    """A trajectory from `start`, the joints' state at time 0, through `points` in order of time."""

    def __init__(self, start: TrajectoryPoint, points: Sequence[TrajectoryPoint]) -> None:
        self._points = [start, *points]

    @property
    def end(self) -> float:
        """The time of the last point in s."""
        return self._points[-1].time

    def at(self, time: float) -> Sample:
        """The wanted state of the joints at a time (s). After the end they rest at the last point."""
        last = self._points[-1]
        if time >= last.time:
            still = np.zeros(len(last.positions))
            return Sample(np.array(last.positions), still, still)
        after = bisect_right(self._points, time, key=lambda point: point.time)
        return _between(self._points[after - 1], self._points[after], time)


def _between(a: TrajectoryPoint, b: TrajectoryPoint, time: float) -> Sample:
    """The polynomial of the lowest degree that satisfies both points."""
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
    """The value and the derivatives of a polynomial."""
    zero = np.zeros_like(coefficients[0])
    position = sum((k * t**n for n, k in enumerate(coefficients)), zero)
    velocity = sum((n * k * t ** (n - 1) for n, k in enumerate(coefficients) if n), zero)
    acceleration = sum((n * (n - 1) * k * t ** (n - 2) for n, k in enumerate(coefficients) if n > 1), zero)
    return Sample(position, velocity, acceleration)


MOST_POINTS = 100_000
"""A quarter of an hour at 100 Hz. Reading as many points takes a second, in which the simulation waits."""


def joint_command(values: object, interface: str) -> tuple[dict[str, float], Interface]:
    """Check a command. Raises KbotError: `values` does not map joints to numbers, or an unknown interface."""
    if not isinstance(values, Mapping):
        raise KbotError(
            f"a joint command must map joint names to numbers, as {{'arm': 0.5}}, not {reprlib.repr(values)}"
        )
    for name, value in values.items():
        if isinstance(value, bool):
            raise KbotError(f"the command of joint '{name}' must be a number, not {value}")
    try:
        return dict(values), Interface(interface)
    except ValueError:
        hint = did_you_mean(str(interface), list(Interface)) or f"choose from {', '.join(Interface)}"
        raise KbotError(f"unknown joint interface {reprlib.repr(interface)}: {hint}") from None


def trajectory_points(joints: object, points: object) -> tuple[tuple[str, ...], tuple[TrajectoryPoint, ...]]:
    """Check a trajectory. Raises KbotError: a point is not valid, or the times do not increase."""
    if isinstance(joints, str) or not isinstance(joints, Sequence) or not isinstance(points, Sequence):
        raise KbotError("a trajectory must be a list of joints and a list of points")
    if len(points) > MOST_POINTS:
        raise KbotError(
            f"a trajectory may have at most {MOST_POINTS:,} points, not {len(points):,}: split it"
        )
    names = tuple(joints)
    if not names or not all(isinstance(name, str) for name in names) or len(set(names)) < len(names):
        raise KbotError(f"the joints of a trajectory must be distinct names, not {reprlib.repr(joints)}")
    checked = tuple(_point(point, len(names)) for point in points)
    for before, after in pairwise(checked):
        if not after.time > before.time:
            raise KbotError(
                f"the times of a trajectory must increase: {after.time:g} s comes after {before.time:g} s"
            )
    return names, checked


def _point(point: object, count: int) -> TrajectoryPoint:
    if not _is_list(point) or not 2 <= len(point) <= 4:
        raise KbotError(
            f"a point must be (time, positions[, velocities[, accelerations]]), not {reprlib.repr(point)}"
        )
    time, *lists = point
    if not _is_sound(time) or time < 0.0:
        raise KbotError(f"the time of a point must be at least 0 seconds, not {reprlib.repr(time)}")
    for index, values in enumerate(lists):
        if not _is_list(values):
            raise KbotError(f"a point needs lists of numbers, not {reprlib.repr(values)}")
        if len(values) != count and (index == 0 or len(values)):
            raise KbotError(f"a point needs {count} numbers, one per joint, not {len(values)}")
        if not all(map(_is_sound, values)):
            raise KbotError(f"the numbers of a point must be finite, not {reprlib.repr(values)}")
    return TrajectoryPoint(float(time), *(tuple(map(float, values)) for values in lists))


def _is_list(value: object) -> TypeGuard[Sequence[Any]]:  # Any: its values are checked one by one
    # the common types first: a check against an abstract class takes a hundred times as long
    return isinstance(value, tuple | list) or (isinstance(value, Sequence) and not isinstance(value, str))


def _is_sound(value: object) -> TypeGuard[float]:
    return -FURTHEST <= value <= FURTHEST if type(value) is float else is_within(value, FURTHEST)
