"""How much of an objective's variation each dimension explains."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from kbot.sweep.space import Value

_LEVELS = 10
"""A dimension with at most this many values has a group for each. One with more is divided at quantiles."""
_MOST_GROUPS = 30
"""Groups of such a dimension. More would follow the noise of the objective."""


@dataclass(frozen=True, slots=True)
class Effect:
    """The effect of a dimension on an objective.

    share      of the objective's variance that the dimension alone explains, from 0 to 1. NaN if there are
               too few designs
    direction  1 if the objective grows with the value, -1 if it falls, 0 if neither
    """

    share: float
    direction: int


def effect(values: Sequence[Value], objective: Sequence[float]) -> Effect:
    """The effect of a dimension. `values` and `objective` have an entry for each design.

    The share is the first-order sensitivity index Var(E[Y|X]) / Var(Y) of Saltelli et al., *Global
    Sensitivity Analysis: The Primer* (2008). It is estimated from the given designs by the correlation ratio
    of the groups of X. The correction for the number of groups is that of Kelley, *An Unbiased Correlation
    Ratio Measure*, PNAS 21 (1935): a dimension without an effect has a share near 0. The shares do not
    include effects that two dimensions have only together.
    """
    y = np.asarray(objective, float)
    group = _groups(values)
    total = float(((y - y.mean()) ** 2).sum()) if len(y) else 0.0
    count = len(set(group))
    if len(y) <= count or count < 2:
        return Effect(math.nan, 0)
    if total <= 1e-24 * float((y**2).sum()):
        return Effect(0.0, 0)  # all are equal
    within = sum(
        float(((part - part.mean()) ** 2).sum()) for each in set(group) if len(part := y[group == each])
    )
    share = 1.0 - (within / (len(y) - count)) / (total / (len(y) - 1))
    return Effect(min(max(share, 0.0), 1.0), _direction(values, y))


def _groups(values: Sequence[Value]) -> np.ndarray[tuple[int], np.dtype[np.int_]]:
    """The group of each value."""
    different = sorted(set(values), key=lambda value: (isinstance(value, str), value))
    if len(different) <= _LEVELS or isinstance(values[0], str):
        number = {value: index for index, value in enumerate(different)}
        return np.array([number[value] for value in values], int)
    x = np.asarray(values, float)
    groups = min(_MOST_GROUPS, max(2, round(len(x) ** (1 / 3))))
    return np.asarray(np.searchsorted(np.quantile(x, np.linspace(0, 1, groups + 1)[1:-1]), x, "right"), int)


def _direction(values: Sequence[Value], y: np.ndarray[tuple[int], np.dtype[np.float64]]) -> int:
    """The sign of Spearman's rank correlation, if it is significant at 1 %."""
    from scipy.stats import spearmanr  # an extra, and slow to import

    if any(isinstance(value, str) for value in values) or len(set(values)) < 2 or len(y) < 4:
        return 0
    correlation, p = spearmanr(np.asarray(values, float), y)
    return int(math.copysign(1, correlation)) if p < 0.01 else 0
