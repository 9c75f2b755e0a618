"""The distance from each cell of a grid to the nearest occupied cell."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from kbot.navigation.inflation import distance_along_rows

Cells = NDArray[np.bool_]
Values = NDArray[np.float32]


def distances(occupied: Cells, most: int) -> Values:
    """The distance in cells, from middle to middle, to the nearest occupied cell, at most `most`.

    Exact: the minimum over all rows within `most` of the distance along the row and across the rows."""
    along = distance_along_rows(occupied, most).astype(np.float32)
    squares = np.minimum(along, np.float32(most)) ** 2
    nearest = squares.copy()
    rows = len(squares)
    for off in range(1, min(most, rows - 1) + 1):
        shifted = squares + np.float32(off * off)
        np.minimum(nearest[off:], shifted[:-off], out=nearest[off:])
        np.minimum(nearest[:-off], shifted[off:], out=nearest[:-off])
    np.minimum(nearest, np.float32(most * most), out=nearest)
    found: Values = np.sqrt(nearest)
    return found


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

    def at(self, x: NDArray[np.float64], y: NDArray[np.float64]) -> NDArray[np.float32]:
        """The distances at points in m, with the value of the cell that holds each point."""
        rows, columns = self.values.shape
        # 1 more for the border; the integer below a number that is not negative
        column = (x - (self.corner[0] - self.resolution)) * (1.0 / self.resolution)
        row = (y - (self.corner[1] - self.resolution)) * (1.0 / self.resolution)
        for cell, last in ((column, columns - 1), (row, rows - 1)):
            np.maximum(cell, 0.0, out=cell)
            np.minimum(cell, last, out=cell)
        flat = row.astype(np.intp) * columns + column.astype(np.intp)
        found: Values = self.values.ravel().take(flat)
        return found
