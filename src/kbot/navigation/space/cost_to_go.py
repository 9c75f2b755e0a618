"""The length of the way from each cell of a grid to the goal, weighted by how near it passes to obstacles.

It is computed by fast sweeping (Zhao 2005) with numpy: each pass goes over the rows, upwards and downwards at
the same time, and propagates within a row by a running minimum. Steps lead to sixteen neighbours, so that a
way is at most 3 % too long. Few passes are enough unless the way winds. A controller reads the way from every
pose that it considers, which a single path does not allow. Jump point search would need its tables again for
each change of the grid.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view
from numpy.typing import NDArray

from kbot.navigation.space.distance_field import squared_distances

Values = NDArray[np.float64]
Positions = NDArray[np.floating[Any]]

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
_MOST_PASSES = 15
"""Passes after which the search ends. A way that winds more is not found."""
_CONVERGED = 1e-3
"""m. The search ends after a pass that shortens no way by more."""
_LENGTHS = np.sqrt([5.0, 2.0, 1.0, 2.0, 5.0, 5.0, 5.0])
"""Cells from the columns -2 to 2 of the next row, and from the columns -1 and 1 of the row after it."""
_least = np.minimum.reduce
_running_least = np.minimum.accumulate


@dataclass(frozen=True, slots=True, eq=False)
class CostToGo:
    """Weighted lengths in m of the ways to the goal; `corner` is the lower left corner of the first cell in
    m."""

    values: Values
    raw: Values
    corner: tuple[float, float]
    resolution: float

    def at(self, x: Positions, y: Positions) -> Values:
        """The lengths at points in m, interpolated between the middles of cells."""
        rows, columns = self.values.shape
        u, v = x * (1.0 / self.resolution), y * (1.0 / self.resolution)
        u -= self.corner[0] / self.resolution + 0.5
        v -= self.corner[1] / self.resolution + 0.5
        for cell, last in ((u, columns - 1.001), (v, rows - 1.001)):
            np.maximum(cell, 0.0, out=cell)
            np.minimum(cell, last, out=cell)
        column, row = u.astype(np.intp), v.astype(np.intp)
        u -= column
        v -= row
        flat, at = self.values.ravel(), row * columns + column
        low, low_right = flat.take(at), flat.take(at + 1)
        at += columns
        high, high_right = flat.take(at), flat.take(at + 1)
        low += (low_right - low) * u
        high += (high_right - high) * u
        high -= low
        high *= v
        high += low
        found: Values = high
        return found

    def at_point(self, x: float, y: float) -> float:
        """The length at one point, ten times as fast as `at`."""
        rows, columns = self.values.shape
        u = min(max((x - self.corner[0]) / self.resolution - 0.5, 0.0), columns - 1.001)
        v = min(max((y - self.corner[1]) / self.resolution - 0.5, 0.0), rows - 1.001)
        column, row = int(u), int(v)
        u, v = u - column, v - row
        item = self.values.item
        low = item(row, column) * (1.0 - u) + item(row, column + 1) * u
        high = item(row + 1, column) * (1.0 - u) + item(row + 1, column + 1) * u
        return float(low * (1.0 - v) + high * v)

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
    most = math.ceil((radius + room) / resolution)
    # a table, because the square of a distance is a small integer
    away = np.sqrt(np.arange(most * most + 1)) * resolution
    near = np.clip(1.0 - (away - radius) / room, 0.0, 1.0)
    table = np.where(away < radius, LETHAL, 1.0 + _NEAR_WEIGHT * near * near)
    found: Values = table.take(squared_distances(occupied, most))
    return found


def costs(occupied: NDArray[np.bool_], resolution: float, radius: float, room: float) -> NDArray[np.int8]:
    """The costs of cells as in a costmap of ROS: 100 in an obstacle, 99 where the robot touches one, and less
    with the distance, down to 0."""
    weight = weights(occupied, resolution, radius, room)
    near = np.round(98.0 / _NEAR_WEIGHT * (np.minimum(weight, 1.0 + _NEAR_WEIGHT) - 1.0))
    return np.where(occupied, 100, np.where(weight >= LETHAL, 99, near)).astype(np.int8)


def halved(weight: Values) -> Values:
    """The lowest weight of each square of 2 x 2 cells, so that a narrow passage stays open."""
    rows, columns = (size // 2 * 2 for size in weight.shape)
    lower = np.minimum(weight[:rows:2, :columns], weight[1:rows:2, :columns])
    lowest: Values = np.minimum(lower[:, ::2], lower[:, 1::2])
    return lowest


def _pair(first: int, second: int) -> slice:
    """The slice of two rows, in this order."""
    step = second - first
    end = second + (1 if step > 0 else -1)
    return slice(first, end if end >= 0 else None, step)


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
        if len(weight) % 2:  # the rows are relaxed in pairs
            weight = np.concatenate([weight, weight[-1:]])
        self._weight, self._corner, self._resolution = weight, corner, resolution
        rows, columns = weight.shape
        x = corner[0] + (np.arange(columns) + 0.5) * resolution
        y = corner[1] + (np.arange(rows) + 0.5) * resolution
        straight = np.hypot(x[None, :] - goal[0], y[:, None] - goal[1])
        self._padded = np.full((rows + 4, columns + 4), 1e9)
        self._values = self._padded[2:-2, 2:-2]
        # each row of `padded`, shifted by -2 to 2 columns: (rows + 4, 5, columns)
        self._shifted = sliding_window_view(self._padded, columns, axis=1)
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
        self._steps = weight[:, None] * (resolution * _LENGTHS[:, None])
        self._ways = np.empty_like(self._steps[:2])
        self._passes, self._is_first_half = 0, True
        self._before = self._values.copy()
        self.is_done = False

    def sweep(self) -> None:
        """Do half of a pass: relax the rows upwards from the first, and at once downwards from the last,
        until they meet, or from there to the ends."""
        middle = len(self._values) // 2
        for row in range(middle) if self._is_first_half else range(middle, 2 * middle):
            self._relax(row)
        self._is_first_half = not self._is_first_half
        if self._is_first_half:
            self._passes += 1
            change = float((self._before - self._values).max())
            self.is_done = change < _CONVERGED or self._passes >= _MOST_PASSES
            self._before[:] = self._values

    def _relax(self, row: int) -> None:
        """Update a row from the two rows below it and from within, and its mirror image from the two rows
        above.

        Calls of numpy take most of the time, not their work: fourteen neighbours are handled at once."""
        rows = len(self._values)
        pair, ways = _pair(row, rows - 1 - row), self._ways
        value, along, steps = self._values[pair], self._along[pair], self._steps[pair]
        near, far = _pair(row + 1, rows + 2 - row), _pair(row, rows + 3 - row)
        np.add(self._shifted[near], steps[:, :5], out=ways[:, :5])
        np.add(self._shifted[far][:, 1:4:2], steps[:, 5:], out=ways[:, 5:])
        np.minimum(value, _least(ways, axis=1), out=value)
        value -= along
        _running_least(value, axis=1, out=value)
        value += along
        value += along
        backwards = value[:, ::-1]
        _running_least(backwards, axis=1, out=backwards)
        value -= along

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
