"""Regions of free cells against a flood from cell to cell."""

import numpy as np
import pytest

from kbot.navigation.regions import Regions


def _flooded(free, start):
    """The cells that steps to four neighbours lead to."""
    found, waiting = {start}, [start]
    while waiting:
        row, column = waiting.pop()
        for to in ((row + 1, column), (row - 1, column), (row, column + 1), (row, column - 1)):
            inside = 0 <= to[0] < free.shape[0] and 0 <= to[1] < free.shape[1]
            if inside and free[to] and to not in found:
                found.add(to)
                waiting.append(to)
    return found


@pytest.mark.parametrize("share", [0.3, 0.55, 0.6, 0.7, 1.0])
def test_cells_are_connected_where_a_flood_leads(share):
    random = np.random.default_rng(7)
    free = random.random((23, 31)) < share
    regions = Regions(free)
    cells = [tuple(cell) for cell in np.argwhere(free).tolist()]
    for start in cells[::40]:
        flooded = _flooded(free, start)
        assert [cell for cell in cells if regions.connect(start, cell)] == sorted(flooded)


def test_a_run_that_ends_a_row_does_not_go_on_in_the_next():
    free = np.array([[False, True], [False, False], [True, False]])
    assert not Regions(free).connect((0, 1), (2, 0))
    free = np.array([[False, True], [True, False]])
    assert not Regions(free).connect((0, 1), (1, 0))
