"""Commands to joints as they come from outside, checked."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from itertools import pairwise
from typing import Any

from kbot.sim.joint_control.kinds import Interface
from kbot.sim.joint_control.trajectory import Point
from kbot.sim.numbers import FURTHEST, is_within, shortened
from kbot.text import KbotError
from kbot.text.suggest import did_you_mean

MOST_POINTS = 100_000
"""A quarter of an hour at 100 Hz: a second of work, for which the run stands."""


def joint_command(values: Any, interface: Any) -> tuple[dict[str, float], Interface]:
    """Raises KbotError for what is no mapping of joints, or an interface that joints do not have."""
    if not isinstance(values, Mapping):
        raise KbotError(f"joints are commanded by name, as in {{'arm': 0.5}}, not {shortened(values)}")
    for name, value in values.items():
        if isinstance(value, bool):
            raise KbotError(f"joint '{name}' is told a number, not {value}")
    try:
        return dict(values), Interface(interface)
    except ValueError:
        hint = did_you_mean(str(interface), list(Interface)) or f"there are {', '.join(Interface)}"
        raise KbotError(f"joints have no interface {shortened(interface)}: {hint}") from None


def trajectory_points(joints: Any, points: Any) -> tuple[tuple[str, ...], tuple[Point, ...]]:
    """Raises KbotError for points that are none, or whose times do not grow."""
    if isinstance(joints, str) or not isinstance(joints, Sequence) or not isinstance(points, Sequence):
        raise KbotError("a trajectory is a list of joints and a list of points")
    if len(points) > MOST_POINTS:
        raise KbotError(
            f"a trajectory has at most {MOST_POINTS:,} points, not {len(points):,}: give it in parts"
        )
    names = tuple(joints)
    if not names or not all(isinstance(name, str) for name in names) or len(set(names)) < len(names):
        raise KbotError(f"the joints of a trajectory are names, each once, not {shortened(joints)}")
    made = tuple(_point(point, len(names)) for point in points)
    for before, after in pairwise(made):
        if not after.time > before.time:
            raise KbotError(
                f"the times of a trajectory grow: {after.time:g} s does not follow {before.time:g} s"
            )
    return names, made


def _point(point: Any, count: int) -> Point:
    if not _is_list(point) or not 2 <= len(point) <= 4:
        raise KbotError(f"a point is a time, positions, and if wanted velocities, not {shortened(point)}")
    time, *lists = point
    if not _is_sound(time) or time < 0.0:
        raise KbotError(f"the time of a point is a number of seconds from 0 on, not {shortened(time)}")
    for index, values in enumerate(lists):
        if not _is_list(values):
            raise KbotError(f"a point has lists of numbers, not {shortened(values)}")
        if len(values) != count and (index == 0 or len(values)):
            raise KbotError(f"a point has {count} numbers, one a joint, not {len(values)}")
        if not all(map(_is_sound, values)):
            raise KbotError(f"a point is made of finite numbers, not {shortened(values)}")
    return Point(float(time), *(tuple(map(float, values)) for values in lists))


def _is_list(value: Any) -> bool:
    # what nearly all are first: an abstract class is asked a hundred times as slowly
    return isinstance(value, tuple | list) or (isinstance(value, Sequence) and not isinstance(value, str))


def _is_sound(value: Any) -> bool:
    return -FURTHEST <= value <= FURTHEST if type(value) is float else is_within(value, FURTHEST)
