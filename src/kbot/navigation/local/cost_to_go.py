"""The length of the way from each cell of a grid to the goal, weighted by how near it passes to obstacles.

It is computed by fast sweeping (Zhao 2005) with numpy: each sweep passes over the rows, and propagates within
a row by a running minimum. Steps lead to sixteen neighbours, so that a way is at most 3 % too long. Few
sweeps are enough unless the way winds. A controller reads the way from every pose that it considers, which a
single path does not allow. Jump point search would need its tables again for each change of the grid.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from kbot.navigation.local.distance_field import distances

Values = NDArray[np.float64]

LETHAL = 1e4
"""Weight of a metre in cells where the robot touches an obstacle. Ways through them exist, so that every cell
has a value, but they are longer than `BLOCKED`."""
BLOCKED = 500.0
"""Metres. A longer way leads through an obstacle."""
_NEAR_WEIGHT = 6.0
"""A metre beside an obstacle counts as this many more metres. The robot then prefers the middle of a
passage."""
_REPULSION = 0.3
"""Metres that the cells of obstacles count more than the nearest free cell."""
_MOST_SWEEPS = 30
_CONVERGED = 1e-3


@dataclass(frozen=True, slots=True, eq=False)
class CostToGo:
    """Weighted lengths in m of the ways to the goal; `corner` is the lower left corner of the first cell in
    m."""

    values: Values
    raw: Values
    corner: tuple[float, float]
    resolution: float

    def at(self, x: Values, y: Values) -> Values:
        """The lengths at points in m, interpolated between the middles of cells."""
        rows, columns = self.values.shape
        u = np.clip((x - self.corner[0]) / self.resolution - 0.5, 0.0, columns - 1.001)
        v = np.clip((y - self.corner[1]) / self.resolution - 0.5, 0.0, rows - 1.001)
        column, row = u.astype(np.intp), v.astype(np.intp)
        u, v = u - column, v - row
        flat, at = self.values.ravel(), row * columns + column
        low = flat[at] * (1.0 - u) + flat[at + 1] * u
        high = flat[at + columns] * (1.0 - u) + flat[at + columns + 1] * u
        found: Values = low * (1.0 - v) + high * v
        return found

    def is_blocked(self, x: float, y: float, radius: float) -> bool:
        """Whether there is no free way to the goal from any cell within `radius` (m) of a point."""
        rows, columns = self.raw.shape
        column = math.floor((x - self.corner[0]) / self.resolution)
        row = math.floor((y - self.corner[1]) / self.resolution)
        reach = max(1, math.ceil(radius / self.resolution))
        part = self.raw[
            min(max(row - reach, 0), rows - 1) : max(row + reach + 1, 1),
            min(max(column - reach, 0), columns - 1) : max(column + reach + 1, 1),
        ]
        return bool(part.min() > BLOCKED)


def weights(occupied: NDArray[np.bool_], resolution: float, radius: float, room: float) -> Values:
    """The weight of a metre in each cell: `LETHAL` nearer to an obstacle than `radius`, and 1 from `room` (m)
    beyond it."""
    away = distances(occupied, math.ceil((radius + room) / resolution)).astype(np.float64) * resolution
    near = np.clip(1.0 - (away - radius) / room, 0.0, 1.0)
    return np.where(away < radius, LETHAL, 1.0 + _NEAR_WEIGHT * near * near)


def halved(weight: Values) -> Values:
    """The lowest weight of each square of 2 x 2 cells, so that a narrow passage stays open."""
    rows, columns = (size // 2 * 2 for size in weight.shape)
    blocks = weight[:rows, :columns].reshape(rows // 2, 2, columns // 2, 2)
    lowest: Values = blocks.min(axis=(1, 3))
    return lowest


class Sweeping:
    """Computes a `CostToGo`, one sweep at a time, so that the work can be shared between control ticks."""

    def __init__(
        self,
        weight: Values,
        corner: tuple[float, float],
        resolution: float,
        goal: tuple[float, float],
        radius: float = 0.0,
    ) -> None:
        """`weight` as `weights` returns it. All places within `radius` (m) of the `goal` are the goal.

        If the goal is outside of the grid, the way beyond the grid is a straight line."""
        self._weight, self._corner, self._resolution = weight, corner, resolution
        rows, columns = weight.shape
        x = corner[0] + (np.arange(columns) + 0.5) * resolution
        y = corner[1] + (np.arange(rows) + 0.5) * resolution
        straight = np.hypot(x[None, :] - goal[0], y[:, None] - goal[1])
        self._padded = np.full((rows + 4, columns + 4), 1e9)
        self._values = self._padded[2:-2, 2:-2]
        inside = (
            corner[0] <= goal[0] < x[-1] + resolution / 2 and corner[1] <= goal[1] < y[-1] + resolution / 2
        )
        if inside:
            source = straight <= max(radius, resolution)
        else:
            source = np.zeros(weight.shape, dtype=bool)
            source[[0, -1]] = source[:, [0, -1]] = True
            source &= weight < LETHAL
        self._values[source] = np.maximum(straight[source] - radius, 0.0)
        step = resolution * (weight[:, 1:] + weight[:, :-1]) / 2.0
        self._along = np.concatenate([np.zeros((rows, 1)), np.cumsum(step, axis=1)], axis=1)
        # the lengths of a straight, a diagonal and a knight's step into each cell
        self._steps = [weight * (resolution * length) for length in (1.0, math.sqrt(2.0), math.sqrt(5.0))]
        self._sweeps = 0
        self._before = self._values.copy()
        self.is_done = False

    def sweep(self) -> None:
        """Pass over the rows once; upwards and downwards in turn."""
        rows = len(self._values)
        upwards = self._sweeps % 2 == 0
        for row in range(rows) if upwards else range(rows - 1, -1, -1):
            self._relax(row, -1 if upwards else 1)
        self._sweeps += 1
        if self._sweeps % 2 == 0:
            change = float((self._before - self._values).max())
            self.is_done = change < _CONVERGED or self._sweeps >= _MOST_SWEEPS
            self._before[:] = self._values

    def _relax(self, row: int, side: int) -> None:
        """Update a row from the two rows on one side of it, and then from within."""
        padded, columns = self._padded, self._values.shape[1]
        near, far = padded[row + 2 + side], padded[row + 2 + 2 * side]
        straight, diagonal, knight = self._steps
        minimum, value, along = np.minimum, self._values[row], self._along[row]
        way = minimum(near[1 : columns + 1], near[3 : columns + 3])
        way += diagonal[row]
        minimum(value, way, out=value)
        minimum(near[:columns], near[4:], out=way)
        minimum(way, far[1 : columns + 1], out=way)
        minimum(way, far[3 : columns + 3], out=way)
        way += knight[row]
        minimum(value, way, out=value)
        np.add(near[2 : columns + 2], straight[row], out=way)
        minimum(value, way, out=value)
        np.subtract(value, along, out=way)
        minimum.accumulate(way, out=way)
        way += along
        minimum(value, way, out=value)
        np.add(value, along, out=way)
        backwards = way[::-1]
        minimum.accumulate(backwards, out=backwards)
        way -= along
        minimum(value, way, out=value)

    def result(self) -> CostToGo:
        """The lengths so far. Those in obstacles are a little above those of the nearest free cell."""
        raw = self._values.copy()
        free = (self._weight < LETHAL) & (raw < BLOCKED)
        known = np.where(free, raw, math.inf)
        for _ in range(3):
            padded = np.pad(known, 1, constant_values=math.inf)
            least = np.minimum(
                np.minimum(padded[:-2, 1:-1], padded[2:, 1:-1]),
                np.minimum(padded[1:-1, :-2], padded[1:-1, 2:]),
            )
            known = np.where(np.isinf(known), least + _REPULSION, known)
        highest = float(known[np.isfinite(known)].max()) if np.isfinite(known).any() else 0.0
        values = np.where(np.isfinite(known), known, highest + 3.0 * _REPULSION)
        return CostToGo(values, raw, self._corner, self._resolution)
