"""Plans paths for a base that steers or drives sideways, over an occupancy grid."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from kbot.kinematics.planar_pose import PlanarPose
from kbot.navigation.path import Path
from kbot.navigation.planning.moves import ORIGIN, HolonomicMoves, SteeredMoves
from kbot.navigation.planning.planner import NoPath, Refusal, occupied_cells, refusal_of_cells, with_points
from kbot.navigation.planning.pose_search import Clearances, Moves, PoseSearch
from kbot.navigation.space.footprint import Outline
from kbot.navigation.space.footprint_clearance import FootprintClearance
from kbot.world.occupancy import OccupancyGrid

Values = NDArray[np.float64]

_MARGIN = 0.01
"""m that a path keeps from obstacles at least, besides what a cell hides."""
_HIDDEN = 0.7
"""Half of a cell's diagonal, in cells: an obstacle may be that much nearer than the middle of its cell."""
_ROOM = 0.5
"""Share of the outline's inner radius within which an obstacle makes a way cost more."""
_MOST_ROOM = 0.3
"""m. The largest such distance."""

MakeMoves = Callable[[float, float], Moves]
"""Makes the moves of a base for the inner radius of its outline and the size of a grid's cells, in m."""


def steered(radius: float, point: PlanarPose = ORIGIN) -> MakeMoves:
    """The moves of a base with a least turning radius in m; `point` is the moving point in its frame."""

    def make(inner: float, resolution: float) -> Moves:
        cell = max(2.0 * resolution, min(radius / 8.0, inner / 2.0))
        return SteeredMoves(radius, cell, max(resolution, radius / 50.0), point)

    return make


def holonomic(turning: float) -> MakeMoves:
    """The moves of a base that drives in every direction; a turn by a radian counts as `turning` m."""

    def make(inner: float, resolution: float) -> Moves:
        return HolonomicMoves(max(2.0 * resolution, inner / 3.0), 1.5 * resolution, turning)

    return make


class PosePlanner:
    """Plans paths over one grid for the true outline of a base. The first plan makes tables that later ones
    use."""

    def __init__(self, grid: OccupancyGrid, outline: Outline, moves: MakeMoves) -> None:
        """`outline` is in the frame of the point that moves, whose poses are planned."""
        self.grid, self.outline = grid, outline
        self._make_moves = moves
        self._search: PoseSearch | None = None

    def with_obstacles(self, points: NDArray[np.float64]) -> PosePlanner:
        """The same planner with the cells of points (n, 2) in m occupied; points off the grid are ignored."""
        return PosePlanner(with_points(self.grid, points), self.outline, self._make_moves)

    def plan(self, start: PlanarPose, goal: PlanarPose, any_heading: bool = False) -> Path | NoPath:
        """The shortest path from a pose to the goal, with the heading at each of its points."""
        grid, origin = self.grid, self.grid.origin
        blocked = occupied_cells(grid)
        refused = refusal_of_cells(grid, blocked, start, goal)
        if refused is not None:
            return refused
        if self._search is None:
            self._search = self._make_search(blocked)
        search, inverse = self._search, origin.inverse()
        first, last = inverse @ start, inverse @ goal
        if float(search.clearance(np.array([[first.x, first.y, first.yaw]]))[0]) < search.keep.least:
            # the robot is there, so what its outline covers and what it touches is free
            search = self._make_search(blocked & ~self._covered(first))
        if not any_heading and float(search.clearance(np.array([[last.x, last.y, last.yaw]]))[0]) <= 0.0:
            at = f"({goal.x:.2f}, {goal.y:.2f})"
            return NoPath(
                Refusal.GOAL_TOO_NEAR, f"the goal {at} is too near an obstacle: the robot does not fit there"
            )
        found = search.find(first, last, any_heading)
        if found is None:
            return NoPath(
                Refusal.UNREACHABLE,
                f"no path wide enough for the robot leads to the goal ({goal.x:.2f}, {goal.y:.2f})",
            )
        points = origin.apply(found[:, :2])
        points[0] = start.x, start.y
        headings: Values = np.unwrap(found[:, 2] + origin.yaw)
        return Path(points, float(headings[-1]), grid.frame, search.keep.least, headings)

    def _covered(self, pose: PlanarPose) -> NDArray[np.bool_]:
        """The cells that the robot touches at a pose in the frame of the grid."""
        grid = self.grid
        x, y = ((np.arange(count) + 0.5) * grid.resolution for count in (grid.columns, grid.rows))
        local = np.stack(pose.local(*np.meshgrid(x, y)), axis=-1).reshape(-1, 2)
        touched = self.outline.grown(_MARGIN + 2.0 * _HIDDEN * grid.resolution).holds(local)
        return touched.reshape(grid.cells.shape)

    def _make_search(self, blocked: NDArray[np.bool_]) -> PoseSearch:
        resolution = self.grid.resolution
        inner = FootprintClearance(self.outline, resolution).inner
        keep = Clearances(_MARGIN + _HIDDEN * resolution, min(_ROOM * inner, _MOST_ROOM))
        return PoseSearch(blocked, resolution, self.outline, self._make_moves(inner, resolution), keep)
