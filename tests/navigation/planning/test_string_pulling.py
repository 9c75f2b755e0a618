"""Paths on a grid are shortened where nothing blocks the view."""

import math

import numpy as np

from kbot.navigation.planning.jump_point_search import JumpPointSearch
from kbot.navigation.planning.string_pulling import pull_taut, sees


def test_a_straightened_path_is_not_longer_than_the_grid_path():
    random = np.random.default_rng(8)
    for _ in range(20):
        free = random.random((30, 30)) > 0.15
        ends = [tuple(cell) for cell in np.argwhere(free)[random.integers(0, free.sum(), 2)].tolist()]
        way = JumpPointSearch(free).find(*ends)
        if way is None:
            continue
        taut = pull_taut(free, way)
        assert (taut[0], taut[-1]) == (way[0], way[-1])
        assert sum(map(math.dist, taut, taut[1:])) <= sum(map(math.dist, way, way[1:])) + 1e-9


def test_a_line_of_sight_ends_at_a_wall():
    free = np.ones((5, 5), dtype=bool)
    free[2, 2] = False
    assert sees(free, (0, 0), (0, 4))
    assert not sees(free, (2, 0), (2, 4))
    assert not sees(free, (0, 0), (4, 4))
