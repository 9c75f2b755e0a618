"""Finds which free cells of a grid are connected to each other."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Cell = tuple[int, int]


class Regions:
    """The connected parts of a grid, with steps to the four neighbours.

    They are found from the runs of free cells in each row, joined to adjacent runs in the next row. This is
    much faster than a search that visits all cells and finds no path."""

    def __init__(self, free: NDArray[np.bool_]) -> None:
        """`free` (rows, columns): the cells in which the robot may be."""
        walled = np.pad(free, ((0, 0), (0, 1)))  # so that no run continues in the next row
        self._width = walled.shape[1]
        changes = np.flatnonzero(np.diff(walled.ravel(), prepend=False))
        self._begins, self._ends = changes[::2], changes[1::2]
        beside = np.searchsorted(self._ends, self._begins + self._width, side="right").tolist()
        beyond = np.searchsorted(self._begins, self._ends + self._width).tolist()
        self._parent = list(range(len(beside)))
        for run, (first, last) in enumerate(zip(beside, beyond, strict=True)):
            for other in range(first, last):
                self._parent[self._root(other)] = self._root(run)

    def connect(self, a: Cell, b: Cell) -> bool:
        """Whether two free cells are connected."""
        return self._root(self._run(a)) == self._root(self._run(b))

    def _run(self, cell: Cell) -> int:
        place = cell[0] * self._width + cell[1]
        return int(np.searchsorted(self._begins, place, side="right")) - 1

    def _root(self, run: int) -> int:
        parent = self._parent
        while parent[run] != run:
            parent[run] = parent[parent[run]]
            run = parent[run]
        return run
