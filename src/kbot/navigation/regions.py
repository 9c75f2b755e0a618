"""Finds which free cells of a grid are connected."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Cell = tuple[int, int]


class Regions:
    """Parts of a grid within which steps to the four neighbours lead everywhere.

    Found by the runs of free cells in its rows, each joined to those it lies beside in the next row: far
    sooner than a search that finds no way has looked everywhere.
    """

    def __init__(self, free: NDArray[np.bool_]) -> None:
        """`free` (rows, columns): where there may be a way."""
        walled = np.pad(free, ((0, 0), (0, 1)))  # no run goes on in the next row
        self._width = walled.shape[1]
        changes = np.flatnonzero(np.diff(walled.ravel(), prepend=False))
        self._begins, self._ends = changes[::2], changes[1::2]
        beside = np.searchsorted(self._ends, self._begins + self._width, side="right").tolist()
        beyond = np.searchsorted(self._begins, self._ends + self._width).tolist()
        self._parent = list(range(len(beside)))
        for run, (first, last) in enumerate(zip(beside, beyond, strict=True)):
            for other in range(first, last):
                self._parent[self._root(other)] = self._root(run)

    def connect(self, one: Cell, other: Cell) -> bool:
        """Whether a way leads from a free cell to another."""
        return self._root(self._run(one)) == self._root(self._run(other))

    def _run(self, cell: Cell) -> int:
        place = cell[0] * self._width + cell[1]
        return int(np.searchsorted(self._begins, place, side="right")) - 1

    def _root(self, run: int) -> int:
        parent = self._parent
        while parent[run] != run:
            parent[run] = parent[parent[run]]
            run = parent[run]
        return run
