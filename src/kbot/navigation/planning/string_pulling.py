"""Shortens a grid path by removing corners that it does not need."""

from __future__ import annotations

import math
from collections.abc import Sequence
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

Cell = tuple[int, int]
Cells = NDArray[np.bool_]

_SPACING = 6
"""A shortened path may bend at the corners of the grid path and at every sixth cell between them."""


def sees(free: Cells, start: Cell, goal: Cell) -> bool:
    """Whether the straight line between the middles of two cells crosses only free cells."""
    rows, columns = goal[0] - start[0], goal[1] - start[1]
    if not rows or not columns:
        (top, bottom), (left, right) = sorted((start[0], goal[0])), sorted((start[1], goal[1]))
        return bool(free[top : bottom + 1, left : right + 1].all())
    count = 2 * max(abs(rows), abs(columns)) + 1
    share = np.arange(count + 1) / count
    # the small addition puts a line along the edge between cells always on the same side
    row = np.floor(start[0] + 0.5 + share * rows + 1e-9).astype(np.intp)
    column = np.floor(start[1] + 0.5 + share * columns + 1e-9).astype(np.intp)
    return bool(free[row, column].all())


def pull_taut(free: Cells, way: Sequence[Cell]) -> list[Cell]:
    """A path of straight lines over free cells that is not longer than the given corners of a grid path.

    It is usually as short as a string pulled tight. The path is shortened from each end, and the shorter
    result is returned."""
    places = _densely(way)
    forwards = _shortened(free, places)
    backwards = _shortened(free, places[::-1])[::-1]
    return min((list(way), backwards, forwards), key=_length)


def _shortened(free: Cells, places: list[Cell]) -> list[Cell]:
    """From each place go straight to the furthest visible one, found by doubling steps and then by
    bisection."""
    taut, at, last = [places[0]], 0, len(places) - 1
    while at < last:
        near, step = at + 1, 2
        while at + step <= last and sees(free, places[at], places[at + step]):
            near, step = at + step, 2 * step
        far = min(at + step, last + 1)
        if far == last + 1 and near < last and sees(free, places[at], places[last]):
            near = last
        while far - near > 1:
            middle = (near + far) // 2
            if sees(free, places[at], places[middle]):
                near = middle
            else:
                far = middle
        taut.append(places[near])
        at = near
    return taut


def _densely(way: Sequence[Cell]) -> list[Cell]:
    """The corners of a path, with cells in between at distances of `_SPACING`."""
    places = [way[0]]
    for (row, column), (to_row, to_column) in pairwise(way):
        steps = max(abs(to_row - row), abs(to_column - column))
        up, right = (to_row - row) // steps, (to_column - column) // steps
        places += [(row + up * n, column + right * n) for n in range(_SPACING, steps, _SPACING)]
        places.append((to_row, to_column))
    return places


def _length(way: Sequence[Cell]) -> float:
    return sum(math.dist(a, b) for a, b in pairwise(way))
