"""Makes a planner for a simulated robot, on the map of its world."""

from __future__ import annotations

from collections.abc import Sequence

from kbot.navigation.planning.planner import Planner
from kbot.navigation.simulated.mobility import BaseKind, Mobility
from kbot.navigation.simulated.shape import world_without_loads
from kbot.sim import Simulation
from kbot.world.occupancy import OccupancyGrid
from kbot.world.occupancy_of_world import HEIGHTS, world_grid

MARGIN = 2.0
"""Free ground in m on the map around all objects of the world."""
MOST_CELLS = 2_000_000
"""Cells of a map. A planner makes the tables of so many in a second."""
FINE = 0.005
MOST_FINE_CELLS = 4_000_000
"""Size of a cell in m, and number of cells, of the map for narrow ways."""


def robot_planner(simulation: Simulation, around: Sequence[tuple[float, float]], moves: Mobility) -> Planner:
    """A planner on the map of a simulation's world, which reaches `MARGIN` beyond the points `around` (m). If
    the map shows no way, the planner uses a map with smaller cells.

    `moves` is how the robot moves now. What the robot carries is not on the map.

    Raises:
        KbotError: the world is too large for a map.
    """
    low, high = HEIGHTS
    world = world_without_loads(simulation)
    heights = low, max(high, moves.shape.height)
    room = moves.shape.radius + (2.0 * moves.steering.radius if moves.steering is not None else 0.0)
    margin = MARGIN if moves.kind is BaseKind.TURNS else max(MARGIN, room)
    grid = world_grid(world, heights=heights, around=around, margin=margin, most_cells=MOST_CELLS)

    def finer() -> OccupancyGrid:
        return world_grid(world, FINE, heights, around, most_cells=MOST_FINE_CELLS)

    return moves.planner(grid, finer)
