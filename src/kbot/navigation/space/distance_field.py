"""The distance from each cell of a grid to the nearest occupied cell."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

Cells = NDArray[np.bool_]
Values = NDArray[np.float32]
Squares = NDArray[np.signedinteger[Any]]


def distances(occupied: Cells, most: int) -> Values:
    """The distance in cells, from middle to middle, to the nearest occupied cell, at most `most`."""
    found: Values = np.sqrt(squared_distances(occupied, most), dtype=np.float32)
    return found


def squared_distances(occupied: Cells, most: int) -> Squares:
    """The square of the distance in cells to the nearest occupied cell, at most that of `most`.

    Exact: the minimum over all rows within `most` of the distance along the row and across the rows. The
    smallest type of integers that holds the squares is several times as fast as floating-point numbers."""
    kind = np.int16 if 2 * most * most < np.iinfo(np.int16).max else np.int32
    along = np.where(occupied, kind(0), kind(most))
    # 1, 2, 4... cells: the sums of these steps are all distances
    step = 1
    while step <= min(most, along.shape[1] - 1):
        for before, after in ((along[:, :-step], along[:, step:]), (along[:, step:], along[:, :-step])):
            np.minimum(after, before + kind(step), out=after)
        step *= 2
    squares: Squares = along * along
    nearest, shifted = squares.copy(), np.empty_like(squares)
    for off in range(1, min(most, len(squares) - 1) + 1):
        np.add(squares, kind(off * off), out=shifted)
        np.minimum(nearest[off:], shifted[:-off], out=nearest[off:])
        np.minimum(nearest[:-off], shifted[off:], out=nearest[:-off])
    return nearest


def inflate(occupied: Cells, radius: float) -> Cells:
    """The occupied cells, and all cells nearer to one than `radius` (in cells, from middle to middle)."""
    if radius <= 0.0:
        return occupied.copy()
    near: Cells = squared_distances(occupied, math.ceil(radius)) < radius * radius
    return near


@dataclass(frozen=True, slots=True, eq=False)
class DistanceField:
    """Distances in m to the nearest obstacle.

    `corner` is the lower left corner of the first cell in m. `most` is the longest distance in the field, and
    the distance outside of it. `values` has a border of such cells on each side."""

    values: Values
    corner: tuple[float, float]
    resolution: float
    most: float

    @classmethod
    def of(
        cls, occupied: Cells, corner: tuple[float, float], resolution: float, most: float
    ) -> DistanceField:
        cells = max(1, round(most / resolution))
        rows, columns = occupied.shape
        values = np.full((rows + 2, columns + 2), cells * resolution, dtype=np.float32)
        values[1:-1, 1:-1] = distances(occupied, cells) * np.float32(resolution)
        return cls(values, corner, resolution, cells * resolution)

    def at(self, x: NDArray[np.floating[Any]], y: NDArray[np.floating[Any]]) -> Values:
        """The distances at points in m, with the value of the cell that holds each point."""
        rows, columns = self.values.shape
        column, row = x * (1.0 / self.resolution), y * (1.0 / self.resolution)
        # 1 more for the border; the integer below a number that is not negative
        column += 1.0 - self.corner[0] / self.resolution
        row += 1.0 - self.corner[1] / self.resolution
        for cell, last in ((column, columns - 1), (row, rows - 1)):
            np.maximum(cell, 0.0, out=cell)
            np.minimum(cell, last, out=cell)
        flat = row.astype(np.intp)
        flat *= columns
        flat += column.astype(np.intp)
        found: Values = self.values.ravel().take(flat)
        return found
