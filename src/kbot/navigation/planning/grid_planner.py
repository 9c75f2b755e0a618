"""Plans paths for a robot that turns on the spot, as a circle of its size, over an occupancy grid."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from kbot.brief import Brief
from kbot.kinematics.planar_pose import PlanarPose
from kbot.navigation.path import Path
from kbot.navigation.planning.jump_point_search import Cell, Cells, JumpPointSearch
from kbot.navigation.planning.planner import (
    NoPath,
    Refusal,
    occupied_cells,
    refusal_of_cells,
    with_points,
    words_of_bounds,
)
from kbot.navigation.planning.string_pulling import pull_taut
from kbot.navigation.space.distance_field import inflate
from kbot.navigation.space.regions import Regions
from kbot.text import KbotError
from kbot.world.occupancy import FREE_BELOW, OccupancyGrid

MARGINS = (0.06, 0.03, 0.01, 0.0)
"""Distances in m to keep from walls in addition to the robot's radius. The widest that leaves a way is
used."""
_NARROW = (Refusal.GOAL_BLOCKED, Refusal.GOAL_TOO_NEAR, Refusal.START_BLOCKED, Refusal.UNREACHABLE)
"""Refusals that a map with smaller cells may lift."""


class GridPlanner(Brief):
    """Plans paths over one grid for a robot of one radius. The first plan makes tables that later ones
    use."""

    def __init__(
        self,
        grid: OccupancyGrid,
        radius: float,
        margins: Sequence[float] = MARGINS,
        unknown_is_free: bool = False,
        finer: Callable[[], OccupancyGrid] | None = None,
    ) -> None:
        """Plan over a grid.

        Args:
            grid: the map.
            radius: distance in m of the robot's furthest point from the point about which it turns.
            margins: distances in m to keep in addition; the widest that leaves a way is used.
            unknown_is_free: whether paths may cross unknown cells.
            finer: makes a map with smaller cells, for ways that are too narrow for the cells of `grid`.

        Raises:
            KbotError: the radius or a margin is not a length.
        """
        if not (math.isfinite(radius) and radius >= 0.0) or not margins or not min(margins) >= 0.0:
            raise KbotError(f"radius and margins must be lengths in m, not {radius} and {list(margins)}")
        self.grid = grid
        self.radius = radius
        self.margins = tuple(sorted(margins, reverse=True))
        self.unknown_is_free = unknown_is_free
        self._make_finer = finer
        self._blocked = occupied_cells(grid, unknown_is_free)
        self._layers = [_Layer(self._blocked, m, self._reach(m)) for m in self.margins]

    def with_obstacles(self, points: NDArray[np.float64]) -> GridPlanner:
        """The same planner with the cells of points (n, 2) in m occupied; points off the grid are ignored."""
        return GridPlanner(with_points(self.grid, points), self.radius, self.margins, self.unknown_is_free)

    @cached_property
    def _finer(self) -> GridPlanner | None:
        if self._make_finer is None:
            return None
        return GridPlanner(self._make_finer(), self.radius, (0.0,), self.unknown_is_free)

    def _reach(self, margin: float) -> float:
        """The distance from obstacles in cells, and half a cell more: the robot may be anywhere in its
        cell."""
        return (self.radius + margin) / self.grid.resolution + 0.5

    def plan(self, start: PlanarPose, goal: PlanarPose, any_heading: bool = False) -> Path | NoPath:
        """The shortest path from the robot's pose to the goal, ending with the goal's heading.

        A robot that turns on the spot reaches every heading, so `any_heading` does not change the path. If
        the robot is too near an obstacle, the path begins at the nearest free cell.
        """
        found = self._plan(start, goal)
        if (
            isinstance(found, NoPath)
            and self._may_be_too_coarse(found, start, goal)
            and self._finer is not None
        ):
            finer = self._finer.plan(start, goal)
            if not isinstance(finer, NoPath) or finer.refusal in _NARROW:
                found = finer
        if isinstance(found, NoPath) and found.refusal is Refusal.UNREACHABLE:
            return self._leads_out(start, goal) or found
        return found

    def _may_be_too_coarse(self, found: NoPath, start: PlanarPose, goal: PlanarPose) -> bool:
        """Whether smaller cells may show a way.

        On a path the robot's middle is at least the radius from every obstacle. If the radius is more than a
        cell's diagonal, all cells on the path are free in this grid too, so they connect start and goal.
        """
        is_wide = self.radius >= math.sqrt(2.0) * self.grid.resolution
        if found.refusal is not Refusal.UNREACHABLE or not is_wide:
            return found.refusal in _NARROW
        first, last = (self.grid.cell(pose.x, pose.y) for pose in (start, goal))
        return Regions(~self._blocked).connect(first, last)

    def _leads_out(self, start: PlanarPose, goal: PlanarPose) -> NoPath | None:
        """The refusal if the robot is inside the box around all obstacles of the map and the goal outside it;
        else None."""
        rows, columns = np.nonzero(self.grid.cells >= FREE_BELOW)
        if not len(rows):
            return None
        first, last = (rows.min(), columns.min()), (rows.max(), columns.max())

        def is_within(pose: PlanarPose) -> bool:
            row, column = self.grid.cell(pose.x, pose.y)
            return bool(first[0] <= row <= last[0] and first[1] <= column <= last[1])

        if is_within(goal) or not is_within(start):
            return None
        reach = words_of_bounds(self.grid, first, last)
        reason = f"the goal {_words(goal)} is outside the walls of the map ({reach}), and no path leads out"
        return NoPath(Refusal.GOAL_OUTSIDE, reason)

    def _plan(self, start: PlanarPose, goal: PlanarPose) -> Path | NoPath:
        grid = self.grid
        first, last = grid.cell(start.x, start.y), grid.cell(goal.x, goal.y)
        refused = refusal_of_cells(grid, self._blocked, start, goal)
        if refused is not None:
            return refused
        for layer in self._layers:
            if not layer.free[last]:
                continue
            begin = first if layer.free[first] else _nearest(layer.free, first, self._reach(0.0) + 2.0)
            if begin is None or not layer.regions.connect(begin, last):
                continue
            way = layer.search.find(begin, last)
            if way is not None:
                return self._path(start, goal, first, pull_taut(layer.free, way), layer.margin)
        if not self._layers[-1].free[last]:
            need = self.radius + self.grid.resolution
            return NoPath(
                Refusal.GOAL_TOO_NEAR,
                f"the goal {_words(goal)} is too near an obstacle: the robot needs {need:.3f} m around it",
            )
        return NoPath(
            Refusal.UNREACHABLE, f"no path wide enough for the robot leads to the goal {_words(goal)}"
        )

    def _path(self, start: PlanarPose, goal: PlanarPose, first: Cell, way: list[Cell], margin: float) -> Path:
        points = self.grid.centers(way)
        points[-1] = goal.x, goal.y
        if way[0] == first:
            points[0] = start.x, start.y
        else:
            points = np.concatenate([[(start.x, start.y)], points])
        if len(points) == 1:
            points = np.array([(start.x, start.y), (goal.x, goal.y)])
        return Path(points, goal.yaw, self.grid.frame, margin)


class _Layer:
    """The free cells of the grid for one distance from obstacles, computed on first use."""

    def __init__(self, blocked: Cells, margin: float, reach: float) -> None:
        self.margin = margin
        self._blocked, self._reach = blocked, reach

    @cached_property
    def free(self) -> NDArray[np.bool_]:
        return ~inflate(self._blocked, self._reach)

    @cached_property
    def regions(self) -> Regions:
        return Regions(self.free)

    @cached_property
    def search(self) -> JumpPointSearch:
        return JumpPointSearch(self.free)


def _nearest(free: Cells, cell: Cell, most: float) -> Cell | None:
    """The nearest free cell that is at most `most` cells away."""
    reach = math.ceil(most)
    top, left = max(0, cell[0] - reach), max(0, cell[1] - reach)
    near = np.argwhere(free[top : cell[0] + reach + 1, left : cell[1] + reach + 1])
    if not len(near):
        return None
    away = np.hypot(near[:, 0] + top - cell[0], near[:, 1] + left - cell[1])
    best = int(np.argmin(away))
    return (int(near[best, 0]) + top, int(near[best, 1]) + left) if away[best] <= most else None


def _words(pose: PlanarPose) -> str:
    return f"({pose.x:.2f}, {pose.y:.2f})"
