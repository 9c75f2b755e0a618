"""Inflates obstacles: marks the cells in which the robot's centre would be too near an obstacle."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

Cells = NDArray[np.bool_]


def inflate(blocked: Cells, radius: float) -> Cells:
    """The blocked cells, and all cells nearer to one than `radius` (in cells, from middle to middle).

    For each row distance, a cell is too near if the distance along the row to the nearest blocked cell is
    below half the chord of a circle at that distance."""
    if radius <= 0.0:
        return blocked.copy()
    reach = math.ceil(radius)
    along = distance_along_rows(blocked, reach)
    grown = blocked.copy()
    rows = blocked.shape[0]
    for off in range(min(reach, rows - 1) + 1):
        half = radius * radius - off * off
        if half <= 0.0:
            break
        near = along < math.sqrt(half)
        grown[off:] |= near[: rows - off]
        grown[: rows - off] |= near[off:]
    return grown


def distance_along_rows(blocked: Cells, most: int) -> NDArray[np.int32]:
    """The distance in cells to the nearest blocked cell in the same row, at most `most` + 1."""
    columns = blocked.shape[1]
    index = np.arange(columns, dtype=np.int32)
    far = np.int32(columns + most + 1)
    before = np.maximum.accumulate(np.where(blocked, index, -far), axis=1)
    after = np.minimum.accumulate(np.where(blocked, index, columns + far)[:, ::-1], axis=1)[:, ::-1]
    return np.minimum(np.minimum(index - before, after - index), most + 1).astype(np.int32)
