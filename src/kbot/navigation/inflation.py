"""Inflates obstacles: marks the cells in which the robot's centre would be too near to one."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

Cells = NDArray[np.bool_]


def inflate(blocked: Cells, radius: float) -> Cells:
    """Cells nearer than `radius` (in cells, middle to middle) to a blocked one; a blocked one is among them.

    Row by row: the distance along a row to the nearest blocked cell, held against what a circle leaves of
    the radius so many rows away.
    """
    if radius <= 0.0:
        return blocked.copy()
    reach = math.ceil(radius)
    along = _distance_along_rows(blocked, reach)
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


def _distance_along_rows(blocked: Cells, most: int) -> NDArray[np.int32]:
    """Cells to the nearest blocked one of the same row, `most` + 1 where it is further."""
    columns = blocked.shape[1]
    index = np.arange(columns, dtype=np.int32)
    far = np.int32(columns + most + 1)
    before = np.maximum.accumulate(np.where(blocked, index, -far), axis=1)
    after = np.minimum.accumulate(np.where(blocked, index, columns + far)[:, ::-1], axis=1)[:, ::-1]
    return np.minimum(np.minimum(index - before, after - index), most + 1).astype(np.int32)
