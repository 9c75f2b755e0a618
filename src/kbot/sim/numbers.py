"""Checks numbers that a simulation receives: finite, and within bounds."""

from __future__ import annotations

import math
import reprlib
from collections.abc import Iterable
from numbers import Real
from typing import TypeGuard

from kbot.text import KbotError
from kbot.world.world import FURTHEST as FURTHEST

Vector = tuple[float, float, float]
"""Along x, y, z."""

FASTEST = 1e4
"""m/s or rad/s; nothing on wheels goes so fast, a run that blows up does at once."""
STRONGEST = 1e6
"""N or N m: the weight of a hundred tonnes."""
LONGEST = 1e9
"""Seconds: thirty years."""


def is_finite(value: object) -> TypeGuard[float]:
    """Whether it is a finite number, and a number at all."""
    if type(value) is float:
        return math.isfinite(value)
    try:
        return isinstance(value, Real) and math.isfinite(value)
    except OverflowError:
        return False


def is_within(value: object, most: float) -> TypeGuard[float]:
    """Whether it is a number from `-most` to `most`."""
    return is_finite(value) and -most <= value <= most


def positive(what: str, value: object, most: float) -> float:
    """The number, which is above zero and at most `most`. Raises KbotError where it is not."""
    if not (is_within(value, most) and value > 0.0):
        raise KbotError(
            f"{what} is a finite number above zero and at most {most:g}, not {reprlib.repr(value)}"
        )
    return float(value)


def vector(what: str, values: Iterable[object], most: float) -> Vector:
    """The three numbers, each from `-most` to `most`. Raises KbotError where they are not."""
    try:
        x, y, z = values
    except (TypeError, ValueError):
        raise KbotError(f"{what} is three numbers, along x, y and z, not {reprlib.repr(values)}") from None
    if not (is_within(x, most) and is_within(y, most) and is_within(z, most)):
        raise KbotError(
            f"{what} is three finite numbers up to {most:g} either way, not {reprlib.repr(values)}"
        )
    return float(x), float(y), float(z)
