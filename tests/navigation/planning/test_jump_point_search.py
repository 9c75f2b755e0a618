"""Jump point search against plain Dijkstra on the same grids."""

import heapq
import math
from itertools import pairwise

import numpy as np
import pytest

from kbot.navigation.planning.jump_point_search import JumpPointSearch


def _dijkstra(free, start, goal):
    rows, columns = free.shape
    cost, heap = {start: 0.0}, [(0.0, start)]
    while heap:
        so_far, (r, c) = heapq.heappop(heap)
        if (r, c) == goal:
            return so_far
        if so_far > cost[r, c]:
            continue
        for dr in (-1, 0, 1):
            for dc in (-1, 0, 1):
                to = r + dr, c + dc
                if not (0 <= to[0] < rows and 0 <= to[1] < columns and free[to]) or not (dr or dc):
                    continue
                if dr and dc and not (free[r + dr, c] and free[r, c + dc]):
                    continue
                new = so_far + math.hypot(dr, dc)
                if new < cost.get(to, math.inf) - 1e-12:
                    cost[to] = new
                    heapq.heappush(heap, (new, to))
    return None


def _length(free, way):
    """The length of a path. Fails if the path is not straight, leaves the free cells or cuts a corner."""
    total = 0.0
    for (r, c), (er, ec) in pairwise(way):
        steps = max(abs(er - r), abs(ec - c))
        dr, dc = (er - r) // steps, (ec - c) // steps
        assert (r + dr * steps, c + dc * steps) == (er, ec)
        for _ in range(steps):
            assert free[r + dr, c + dc]
            assert free[r + dr, c]
            assert free[r, c + dc]
            r, c = r + dr, c + dc
            total += math.hypot(dr, dc)
    return total


@pytest.mark.parametrize("share", [0.0, 0.1, 0.25, 0.4, 0.5])
def test_paths_are_as_short_as_dijkstras(share):
    random = np.random.default_rng(round(share * 100))
    for _ in range(40):
        free = random.random((random.integers(1, 24), random.integers(1, 24))) >= share
        search = JumpPointSearch(free)
        for _ in range(4):
            start, goal = (tuple(random.integers(0, free.shape).tolist()) for _ in range(2))
            free_ends = free[start] and free[goal]
            expected = _dijkstra(free, start, goal) if free_ends else None
            way = search.find(start, goal)
            if expected is None:
                assert way is None
            else:
                assert way[0] == start
                assert way[-1] == goal
                assert _length(free, way) == pytest.approx(expected, abs=1e-9)
