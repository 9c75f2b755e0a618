"""Shortest paths on a grid by jump point search, a fast form of A*.

JPS+ computes tables beforehand (D. Harabor and A. Grastien, "Improving jump point search", ICAPS 2014; the
tables as in S. Rabin and F. Silva, "JPS+", Game AI Pro 2, 2015). A step goes to one of eight neighbours and
never cuts the corner of a blocked cell. The paths are as short as those of A*. The tables are computed by
whole rows, so no compiled code is needed."""

from __future__ import annotations

import heapq
import math
from typing import TypeVar

import numpy as np
from numpy.typing import NDArray

S = TypeVar("S", bound=np.generic)
Cell = tuple[int, int]
Cells = NDArray[np.bool_]
Table = NDArray[np.int32]

_STEPS: tuple[Cell, ...] = ((0, 1), (1, 0), (0, -1), (-1, 0), (1, 1), (1, -1), (-1, -1), (-1, 1))
"""Row and column of a step: east, north, west, south, then the diagonals from north-east on."""

_ONWARD: tuple[tuple[int, ...], ...] = (
    (0, 4, 7, 1, 3),
    (1, 4, 5, 0, 2),
    (2, 5, 6, 1, 3),
    (3, 6, 7, 0, 2),
    (4, 0, 1),
    (5, 1, 2),
    (6, 2, 3),
    (7, 0, 3),
)
"""The directions to search from a cell, by the direction in which the cell was reached."""

_DIAGONAL = math.sqrt(2.0)


class JumpPointSearch:
    """Finds shortest paths between free cells of one grid."""

    def __init__(self, free: Cells) -> None:
        """`free` (rows, columns): the cells that a path may use."""
        self.free = np.pad(free, 1)
        self._width = self.free.shape[1]
        straight = [_straight(self.free, step) for step in _STEPS[:4]]
        diagonal = [_diagonal(self.free, straight, step) for step in _STEPS[4:]]
        self._tables = [table.ravel().data for table in (*straight, *diagonal)]
        self._offsets = tuple(row * self._width + column for row, column in _STEPS)
        self._all = tuple(range(8))

    def find(self, start: Cell, goal: Cell) -> list[Cell] | None:
        """The turning points of a shortest path, with both ends; None if there is no path or an end is not
        free."""
        width = self._width
        first, last = ((cell[0] + 1) * width + cell[1] + 1 for cell in (start, goal))
        if not (self.free.flat[first] and self.free.flat[last]):
            return None
        if first == last:
            return [start]
        goal_row, goal_column = divmod(last, width)
        cost = {first: 0.0}
        came: dict[int, tuple[int, int]] = {}
        closed: set[int] = set()
        heap = [(0.0, first)]
        while heap:
            _, at = heapq.heappop(heap)
            if at == last:
                return self._trace(came, first, last)
            if at in closed:
                continue
            closed.add(at)
            so_far = cost[at]
            onward = _ONWARD[came[at][1]] if at in came else self._all
            row, column = divmod(at, width)
            for direction in onward:
                length = self._jump(at, direction, goal_row - row, goal_column - column)
                if not length:
                    continue
                to = at + length * self._offsets[direction]
                new = so_far + (length if direction < 4 else length * _DIAGONAL)
                if new < cost.get(to, math.inf) - 1e-9:
                    cost[to] = new
                    came[to] = at, direction
                    closed.discard(to)
                    to_row, to_column = divmod(to, width)
                    far, near = abs(goal_row - to_row), abs(goal_column - to_column)
                    ahead = far + (_DIAGONAL - 1) * near if far > near else near + (_DIAGONAL - 1) * far
                    heapq.heappush(heap, (new + ahead, to))
        return None

    def _jump(self, at: int, direction: int, rows: int, columns: int) -> int:
        """How many cells to jump in a direction: to the goal or level with it if it is on the way, else to
        the next turning point; 0 if there is none. `rows` and `columns` are the distances to the goal."""
        jump = self._tables[direction][at]
        reach = jump if jump > 0 else -jump
        row, column = _STEPS[direction]
        if direction < 4:
            ahead = rows * row + columns * column
            if 0 < ahead <= reach and not (rows if column else columns):
                return ahead
        else:
            aside = min(rows * row, columns * column)
            if 0 < aside <= reach:
                return aside
        return jump if jump > 0 else 0

    def _trace(self, came: dict[int, tuple[int, int]], first: int, last: int) -> list[Cell]:
        way, at = [last], last
        while at != first:
            at = came[at][0]
            way.append(at)
        return [(at // self._width - 1, at % self._width - 1) for at in reversed(way)]


def _straight(free: Cells, step: Cell) -> Table:
    """For each cell the number of cells to the next turning point in a direction.

    If a wall comes first, it is minus the number of free cells before the wall.
    """
    view = _facing(free, step)
    columns = view.shape[1]
    blocked = ~view
    turns = np.zeros_like(view)
    for side, other in (((slice(1, None)), slice(None, -1)), (slice(None, -1), slice(1, None))):
        # a cell beside which a wall ends: from here the path can turn to the cells behind the wall
        turns[other, 1:] |= view[side, 1:] & blocked[side, :-1]
    turns[:, 1:] &= view[:, 1:] & view[:, :-1]
    index = np.arange(columns, dtype=np.int32)
    beyond = np.int32(columns)
    turn, wall = (_next(mask, index, beyond) for mask in (turns, blocked))
    table = np.where(turn < wall, turn - index, index + 1 - wall)
    table[blocked] = 0
    found = np.empty(free.shape, dtype=np.int32)
    _facing(found, step)[...] = table
    return found


def _next(mask: Cells, index: NDArray[np.int32], beyond: np.int32) -> Table:
    """The column of the next cell to the right for which the mask is True."""
    own = np.where(mask, index, beyond)
    after = np.full(mask.shape, beyond, dtype=np.int32)
    after[:, :-1] = np.minimum.accumulate(own[:, :0:-1], axis=1)[:, ::-1]
    return after


def _facing(array: NDArray[S], step: Cell) -> NDArray[S]:
    """A view of the array, rotated so that a straight step leads to the right."""
    row, column = step
    turned = array.T if row else array
    return turned[:, ::-1] if row + column < 0 else turned


def _diagonal(free: Cells, straight: list[Table], step: Cell) -> Table:
    """As `_straight`, for a diagonal direction. Cells with a turning point straight ahead count too."""
    row, column = step
    view = free[::row, ::column]
    along = straight[0 if column > 0 else 2][::row, ::column]
    across = straight[1 if row > 0 else 3][::row, ::column]
    passes = np.zeros(view.shape, dtype=bool)
    passes[:-1, :-1] = view[:-1, :-1] & view[1:, :-1] & view[:-1, 1:] & view[1:, 1:]
    ends = np.zeros(view.shape, dtype=bool)
    ends[:-1, :-1] = (along[1:, 1:] > 0) | (across[1:, 1:] > 0)
    ends &= passes
    table = np.zeros(view.shape, dtype=np.int32)
    for at in range(view.shape[0] - 2, -1, -1):
        before = table[at + 1, 1:]
        own = table[at, :-1]
        np.add(before, np.where(before > 0, 1, -1), out=own)
        own *= passes[at, :-1]
        own[ends[at, :-1]] = 1
    found = np.empty(free.shape, dtype=np.int32)
    found[::row, ::column] = table
    return found
