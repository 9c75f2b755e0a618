"""Regions of free cells, compared with a flood fill."""

import numpy as np
import pytest

from kbot.navigation.space.regions import Regions


def _flooded(free, start):
    """The cells that steps to the four neighbours reach."""
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
def test_connected_cells_are_those_that_a_flood_fill_reaches(share):
    random = np.random.default_rng(7)
    free = random.random((23, 31)) < share
    regions = Regions(free)
    cells = [tuple(cell) for cell in np.argwhere(free).tolist()]
    for start in cells[::40]:
        flooded = _flooded(free, start)
        assert [cell for cell in cells if regions.connect(start, cell)] == sorted(flooded)


def test_a_run_at_the_end_of_a_row_does_not_continue_in_the_next_row():
    free = np.array([[False, True], [False, False], [True, False]])
    assert not Regions(free).connect((0, 1), (2, 0))
    free = np.array([[False, True], [True, False]])
    assert not Regions(free).connect((0, 1), (1, 0))
