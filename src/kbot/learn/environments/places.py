"""The places of a world where a robot can stand, and the ways between them, on a grid of the world."""

from __future__ import annotations

import math
from dataclasses import replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from kbot.navigation.planning.jump_point_search import JumpPointSearch
from kbot.navigation.planning.string_pulling import pull_taut
from kbot.navigation.space.cost_to_go import BLOCKED, LETHAL, CostToGo, Sweeping
from kbot.navigation.space.distance_field import inflate
from kbot.navigation.space.footprint import height, turning_radius
from kbot.sim import Simulation
from kbot.text import KbotError
from kbot.world.ground import ground_heights
from kbot.world.occupancy import FREE_BELOW, OccupancyGrid
from kbot.world.occupancy_of_world import HEIGHTS, world_grid

_CELL = 0.05
"""m. A way to the goal need not be finer: it only measures progress."""
_MOST_CELLS = 250_000
"""A grid of 25 x 25 m. The ways to a goal are then computed in 0.1 s."""
_ROOM = 0.05
"""m between a robot that starts or has arrived, in any heading, and the nearest obstacle."""
_LEVEL = 0.001
"""m by which the ground at a start may differ from that at the world's origin."""
_TRIES = 20
"""Goals that are drawn before a world counts as too small. In a world of rooms, the first one suffices."""


class Places:
    """The places of a world where a robot can stand, and the ways between them."""

    def __init__(self, simulation: Simulation, reach: float) -> None:
        """`reach` in m is how far the grid extends beyond the robot's start and the objects of the world."""
        first, start = simulation.robots.first, simulation.start
        low, high = HEIGHTS
        heights = low, max(high, height(first.robot, first.base))
        around = [(start.x, start.y)]
        grid = world_grid(simulation.world, _CELL, heights, around, margin=reach, most_cells=_MOST_CELLS)
        self.grid: OccupancyGrid = grid
        self._world, self._start = simulation.world, start
        self._radius = (turning_radius(first.robot, first.base) + _ROOM) / grid.resolution + 0.5
        """The distance in cells that the robot's middle keeps from obstacles."""
        self._weight = np.where(inflate(grid.cells >= FREE_BELOW, self._radius), LETHAL, 1.0)

    @cached_property
    def free(self) -> NDArray[np.intp]:
        """The cells (n, 2), as row and column, that the robot can reach from the world's start.

        Raises:
            KbotError: there is none.
        """
        start = self._start
        reached = self.ways_to(start.x, start.y).raw < BLOCKED
        ground = ground_heights(self._world, self.grid)
        if ground is not None:
            row, column = self.grid.cell(start.x, start.y)
            reached &= np.abs(ground - ground[row, column]) < _LEVEL
        cells = np.argwhere(reached & (self._weight < LETHAL))
        if not len(cells):
            raise KbotError(
                f"world '{self._world.name}' has no place in which the robot can turn without a collision:"
                " choose a wider world"
            )
        return cells

    def ways_to(self, x: float, y: float) -> CostToGo:
        """The lengths in m of the shortest ways to a point that keep the robot away from obstacles."""
        grid = self.grid
        sweeping = Sweeping(self._weight, (grid.origin.x, grid.origin.y), grid.resolution, (x, y))
        while not sweeping.is_done:
            sweeping.sweep()
        found = sweeping.result()
        lengths = found.raw[: grid.rows]  # a row is added where their number is odd
        return replace(found, raw=lengths, values=self._extended(lengths))

    def _extended(self, lengths: NDArray[np.float64]) -> NDArray[np.float64]:
        """The lengths, with those of the nearest free cells near obstacles, where a robot may be too."""
        known = np.where((self._weight < LETHAL) & (lengths < BLOCKED), lengths, np.inf)
        step = self.grid.resolution
        for _ in range(math.ceil(self._radius) + 2):
            padded = np.pad(known, 1, constant_values=np.inf)
            beside = np.minimum(
                np.minimum(padded[:-2, 1:-1], padded[2:, 1:-1]),
                np.minimum(padded[1:-1, :-2], padded[1:-1, 2:]),
            )
            known = np.where(np.isinf(known), beside + step, known)
        # cells that no robot reaches
        return np.where(np.isinf(known), np.max(known, initial=0.0, where=np.isfinite(known)), known)

    def random_goal(
        self, random: np.random.Generator, low: float, high: float
    ) -> tuple[tuple[float, float], CostToGo, NDArray[np.intp]]:
        """A random free point, the ways to it, and the free cells from which they are `low` to `high` m long.

        Raises:
            KbotError: no two places are so far apart.
        """
        for _ in range(_TRIES):
            x, y = self.random_place(random)
            ways = self.ways_to(x, y)
            cells = self.between(ways, low, high)
            if len(cells):
                return (x, y), ways, cells
        raise KbotError(
            f"world '{self._world.name}' has no two places {low:g} to {high:g} m apart: change distance"
        )

    def between(self, ways: CostToGo, low: float, high: float) -> NDArray[np.intp]:
        """The free cells (n, 2) from which ways are `low` to `high` m long."""
        lengths = ways.raw[self.free[:, 0], self.free[:, 1]]
        return self.free[(lengths >= low) & (lengths <= high)]

    def way(self, start: tuple[float, float], goal: tuple[float, float]) -> list[tuple[float, float]]:
        """The corners in m of a shortest way between two free points."""
        cells = self._search.find(self.grid.cell(*start), self.grid.cell(*goal))
        corners = [] if cells is None else pull_taut(self._weight < LETHAL, cells)
        return [start, *(self.grid.center(*cell) for cell in corners[1:-1]), goal]

    @cached_property
    def _search(self) -> JumpPointSearch:
        return JumpPointSearch(self._weight < LETHAL)

    def random_place(
        self, random: np.random.Generator, cells: NDArray[np.intp] | None = None
    ) -> tuple[float, float]:
        """A random point in m in one of the cells, by default in `free`."""
        cells = self.free if cells is None else cells
        row, column = cells[int(random.integers(len(cells)))].tolist()
        return self.grid.center(row, column)
