"""Checks the options of environments."""

from __future__ import annotations

import reprlib
from typing import Any

import numpy as np

from kbot.sim.numbers import is_finite
from kbot.text import KbotError

LONGEST = 1000.0
"""m. The longest way of an episode."""


def require_range(
    name: str, value: object, low: float, high: float, *, may_be_number: bool = False
) -> tuple[float, float]:
    """Two numbers in order, or a number that is both.

    Raises:
        KbotError: the option is something else, or beyond `low` to `high`.
    """
    pair: Any = (value, value) if may_be_number and is_finite(value) else value
    try:
        low_end, high_end = pair
        first, last = float(low_end), float(high_end)
    except (TypeError, ValueError, OverflowError):
        kind = "a number or (low, high)" if may_be_number else "two numbers (low, high)"
        raise KbotError(f"{name} must be {kind}, not {reprlib.repr(value)}") from None
    if not low <= first <= last <= high:
        limits = f"{low:g} <= low <= high <= {high:g}"
        raise KbotError(f"{name} must be (low, high) with {limits}, not {reprlib.repr(value)}")
    return first, last


def require_farther(distance: tuple[float, float], arrive: float) -> None:
    """Raises KbotError: a robot at the lowest distance has arrived at once."""
    if distance[0] <= arrive:
        raise KbotError(f"the lowest distance ({distance[0]:g} m) must be greater than arrive ({arrive:g} m)")


def require_length(name: str, value: object) -> float:
    """A length in m above 0.

    Raises:
        KbotError: the option is something else.
    """
    if isinstance(value, bool) or not isinstance(value, int | float | np.number):
        raise KbotError(f"{name} must be a length in m, not {reprlib.repr(value)}")
    if not 0.0 < value <= LONGEST:
        raise KbotError(f"{name} must be above 0 and at most {LONGEST:g} m, not {reprlib.repr(value)}")
    return float(value)
