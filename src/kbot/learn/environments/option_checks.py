"""Checks the options of environments."""

from __future__ import annotations

from typing import Any

import numpy as np

from kbot.text import KbotError

LONGEST = 1000.0
"""m. The longest way of an episode."""


def require_range(name: str, value: Any, low: float, high: float) -> tuple[float, float]:  # noqa: ANN401 - a user's
    """Two numbers in order. Raises KbotError: the option is something else, or beyond `low` to `high`."""
    try:
        low_end, high_end = value
        first, last = float(low_end), float(high_end)
    except (TypeError, ValueError):
        raise KbotError(f"{name} must be two numbers (low, high), not {value!r}") from None
    if not low <= first <= last <= high:
        raise KbotError(f"{name} must be (low, high) with {low:g} <= low <= high <= {high:g}, not {value!r}")
    return first, last


def require_farther(distance: tuple[float, float], arrive: float) -> None:
    """Raises KbotError: a robot at the lowest distance has arrived at once."""
    if distance[0] <= arrive:
        raise KbotError(f"the lowest distance ({distance[0]:g} m) must be greater than arrive ({arrive:g} m)")


def require_length(name: str, value: object) -> float:
    """A length in m above 0. Raises KbotError: the option is something else."""
    if isinstance(value, bool) or not isinstance(value, int | float | np.number):
        raise KbotError(f"{name} must be a length in m, not {value!r}")
    if not 0.0 < value <= LONGEST:
        raise KbotError(f"{name} must be above 0 and at most {LONGEST:g} m, not {value!r}")
    return float(value)
