"""Checks that the numbers given to a simulation are finite and within bounds."""

from __future__ import annotations

import math
import reprlib
from collections.abc import Iterable
from numbers import Real
from typing import TypeGuard

from kbot.text import KbotError
from kbot.world.world import FURTHEST as FURTHEST

Vector = tuple[float, float, float]
"""x, y, z."""

FASTEST = 1e4
"""Largest speed in m/s or rad/s.

No wheeled robot is this fast, and a run that diverges exceeds it at once.
"""
STRONGEST = 1e6
"""Largest force or torque in N or N m: the weight of 100 tonnes."""
LONGEST = 1e9
"""Longest time in s: about 30 years."""


def is_finite(value: object) -> TypeGuard[float]:
    """Whether a value is a number and finite."""
    if type(value) is float:
        return math.isfinite(value)
    try:
        return isinstance(value, Real) and math.isfinite(value)
    except OverflowError:
        return False


def is_within(value: object, most: float) -> TypeGuard[float]:
    """Whether a value is a number from `-most` to `most`."""
    return is_finite(value) and -most <= value <= most


def positive(what: str, value: object, most: float) -> float:
    """Return `value` as a float. Raises KbotError if it is not a number above 0 and at most `most`."""
    if not (is_within(value, most) and value > 0.0):
        raise KbotError(
            f"{what} must be a finite number above 0 and at most {most:g}, not {reprlib.repr(value)}"
        )
    return float(value)


def vector(what: str, values: Iterable[object], most: float) -> Vector:
    """Return three values as floats. Raises KbotError if one is not a number from `-most` to `most`."""
    try:
        x, y, z = values
    except (TypeError, ValueError):
        raise KbotError(f"{what} must be three numbers x, y, z, not {reprlib.repr(values)}") from None
    if not (is_within(x, most) and is_within(y, most) and is_within(z, most)):
        raise KbotError(
            f"{what} must be three finite numbers from -{most:g} to {most:g}, not {reprlib.repr(values)}"
        )
    return float(x), float(y), float(z)
