"""Which values a sweep tries: a grid, random values, or a Latin hypercube.

A design is one combination of values. Each is computed from its number alone, so that a resumed sweep needs
only the missing ones.
"""

from __future__ import annotations

from collections.abc import Sequence
from enum import StrEnum
from typing import Protocol

import numpy as np

from kbot.sweep.space import Space, Values

SEED = 0
"""Seed of all random designs. It is fixed, so that the same command gives the same designs."""
_BLOCK = 1024
"""Random designs that are drawn at once, because a generator for each would take longer than drawing them."""


MOST_TOGETHER = 1_000_000
"""Designs of a Latin hypercube, which are drawn together and kept in memory."""


class Method(StrEnum):
    """How designs are chosen."""

    GRID = "grid"
    RANDOM = "random"
    LHS = "lhs"
    OPTIMIZE = "optimize"


class Designs(Protocol):
    """Chooses designs by their number.

    `window`: design n can be chosen as soon as all designs up to n - window are reported. None: at any time,
    in any order, and nothing needs to be reported.
    """

    window: int | None

    def values(self, number: int) -> Values:
        """The values of a design. With a window, called once for each number in order."""
        ...

    def report(self, number: int, objectives: Sequence[float] | None, *, passed: bool) -> None:
        """Report the result of a design, in the order of the numbers.

        `objectives` is None if a run of the design failed before it could be measured.
        """
        ...


class _Independent:
    """Designs that do not depend on results."""

    window: int | None = None

    def report(self, number: int, objectives: Sequence[float] | None, *, passed: bool) -> None:
        """Results are not used."""


class Grid(_Independent):
    """All combinations in order. The last dimension varies fastest."""

    def __init__(self, space: Space) -> None:
        self._space = space

    def values(self, number: int) -> Values:
        return self._space.grid(number)


class Random(_Independent):
    """Independent random values, uniform over each dimension."""

    def __init__(self, space: Space) -> None:
        self._space = space
        self._block, self._fractions = -1, np.zeros((0, 0))

    def values(self, number: int) -> Values:
        block, row = divmod(number, _BLOCK)
        if block != self._block:
            shape = (_BLOCK, len(self._space.dimensions))
            self._block, self._fractions = block, np.random.default_rng((SEED, block)).random(shape)
        return self._space.at(self._fractions[row].tolist())


class LatinHypercube(_Independent):
    """`count` designs of which each has a share of 1 / count of each dimension to itself (McKay, 1979)."""

    def __init__(self, space: Space, count: int) -> None:
        from scipy.stats import qmc  # slow to import

        self._space = space
        self._sample = qmc.LatinHypercube(len(space.dimensions), rng=SEED).random(count)

    def values(self, number: int) -> Values:
        return self._space.at(self._sample[number].tolist())
