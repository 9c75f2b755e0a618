"""The interface of planners: a grid and two poses in, a path or the reason for none out."""

from __future__ import annotations

from dataclasses import dataclass
from enum import StrEnum
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from kbot.kinematics.planar_pose import PlanarPose
from kbot.navigation.path import Path
from kbot.navigation.planning.jump_point_search import Cell, Cells
from kbot.world.occupancy import FREE_BELOW, OCCUPIED, UNKNOWN, OccupancyGrid


class Refusal(StrEnum):
    """Why there is no path."""

    GOAL_OUTSIDE = "goal outside the map"
    GOAL_BLOCKED = "goal inside an obstacle"
    GOAL_TOO_NEAR = "goal too near an obstacle"
    GOAL_UNKNOWN = "goal on unknown ground"
    START_OUTSIDE = "start outside the map"
    START_BLOCKED = "start inside an obstacle"
    UNREACHABLE = "goal unreachable"


@dataclass(frozen=True, slots=True)
class NoPath:
    """Why there is no path: the kind of refusal, and the reason in one sentence."""

    refusal: Refusal
    reason: str


class Planner(Protocol):
    """Plans paths over a grid."""

    grid: OccupancyGrid

    def with_obstacles(self, points: NDArray[np.float64]) -> Planner:
        """The same planner with the cells of points (n, 2) in m occupied; points off the grid are ignored."""
        ...

    def plan(self, start: PlanarPose, goal: PlanarPose, any_heading: bool = False) -> Path | NoPath:
        """The shortest path from a pose to the goal; `any_heading`: the goal's yaw does not matter."""
        ...


def occupied_cells(grid: OccupancyGrid, unknown_is_free: bool = False) -> Cells:
    """The cells of a grid that a robot may not enter."""
    taken: Cells = grid.cells >= FREE_BELOW
    return taken if unknown_is_free else taken | (grid.cells == UNKNOWN)


def with_points(grid: OccupancyGrid, points: NDArray[np.float64]) -> OccupancyGrid:
    """A grid with the cells of points (n, 2) in m occupied; points off the grid are ignored."""
    cells = grid.cells.copy()
    for x, y in points.tolist():
        row, column = grid.cell(x, y)
        if grid.contains(row, column):
            cells[row, column] = OCCUPIED
    return OccupancyGrid(cells, grid.resolution, grid.origin, grid.frame)


def refusal_of_cells(
    grid: OccupancyGrid, blocked: Cells, start: PlanarPose, goal: PlanarPose
) -> NoPath | None:
    """Why no robot can drive from start to goal, if one of them is in a cell where no robot can be."""
    first, last = grid.cell(start.x, start.y), grid.cell(goal.x, goal.y)
    if not grid.contains(*last):
        reach = words_of_bounds(grid, (0, 0), (grid.rows - 1, grid.columns - 1))
        return NoPath(Refusal.GOAL_OUTSIDE, f"the goal is outside the map ({reach})")
    if not grid.contains(*first):
        return NoPath(Refusal.START_OUTSIDE, "the robot is outside the map")
    if blocked[last]:
        if grid.cells[last] == UNKNOWN:
            return NoPath(Refusal.GOAL_UNKNOWN, "the goal is on unknown ground of the map")
        return NoPath(Refusal.GOAL_BLOCKED, "the goal is inside an obstacle")
    if blocked[first]:
        return NoPath(Refusal.START_BLOCKED, "the robot is inside an obstacle of the map")
    return None


def words_of_bounds(grid: OccupancyGrid, first: Cell, last: Cell) -> str:
    """The range of x and y of a block of cells, up to their outer edges, in the grid's frame."""
    rows, columns = (first[0] - 0.5, last[0] + 0.5), (first[1] - 0.5, last[1] + 0.5)
    corners = grid.centers([(row, column) for row in rows for column in columns])
    (west, south), (east, north) = corners.min(axis=0), corners.max(axis=0)
    return f"x from {west:.2f} to {east:.2f} m, y from {south:.2f} to {north:.2f} m"
