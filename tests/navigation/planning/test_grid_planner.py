"""Plans on small grids whose results are computed by hand, and every refusal."""

import math

import numpy as np
import pytest

from kbot.kinematics import PlanarPose
from kbot.navigation.path import Path
from kbot.navigation.planning.grid_planner import GridPlanner
from kbot.navigation.planning.planner import NoPath, Refusal
from kbot.text import KbotError
from kbot.world.builders import box
from kbot.world.occupancy import OccupancyGrid
from kbot.world.occupancy_of_world import world_grid
from kbot.world.world import World

START = PlanarPose(0.55, 0.55)


def _grid(rows=40, columns=40, resolution=0.1):
    return OccupancyGrid(np.zeros((rows, columns), dtype=np.int8), resolution)


def test_open_ground_is_crossed_in_a_straight_line():
    path = GridPlanner(_grid(), 0.1).plan(START, PlanarPose(3.3, 1.7, 0.5))
    assert path.points.tolist() == [[0.55, 0.55], [3.3, 1.7]]
    assert path.length == pytest.approx(math.hypot(2.75, 1.15))
    assert path.yaw == 0.5


def test_a_wall_is_rounded_at_its_end():
    grid = _grid()
    grid.cells[:30, 20] = 100
    path = GridPlanner(grid, 0.1, margins=(0.0,)).plan(PlanarPose(1.05, 0.55), PlanarPose(3.05, 0.55))
    # the wall ends at y = 3.0 and x = 2.0 to 2.1: a path around it is at least this long
    taut = 2 * math.hypot(0.95, 2.45)
    assert taut < path.length < taut + 0.6
    for x, y in path.points[1:-1].tolist():
        assert math.hypot(max(2.0 - x, x - 2.1, 0.0), max(y - 3.0, 0.0)) >= 0.1


def test_no_piece_of_a_path_comes_nearer_than_the_radius():
    random = np.random.default_rng(4)
    grid = _grid(80, 80, 0.05)
    grid.cells[random.random((80, 80)) < 0.02] = 100
    walls = grid.centers(np.argwhere(grid.cells == 100))
    planner = GridPlanner(grid, 0.1, margins=(0.02,))
    planned = 0
    for _ in range(40):
        ends = [PlanarPose(*random.uniform(0.2, 3.8, 2)) for _ in range(2)]
        path = planner.plan(*ends)
        if isinstance(path, NoPath) or len(path.points) < 2:
            continue
        planned += 1
        share = np.linspace(0, 1, 400)[:, None]
        for a, b in zip(path.points[1:-1], path.points[2:], strict=False):
            places = a + share * (b - a)
            assert np.abs(places[:, None] - walls[None]).max(axis=2).min() > 0.0
            assert np.hypot(*(places[:, None] - walls[None]).transpose(2, 0, 1)).min() > 0.1
    assert planned > 10


def test_a_narrow_way_is_used_only_if_no_wider_one_exists():
    grid = _grid()
    grid.cells[:, 20] = 100
    grid.cells[18:22, 20] = 0
    planner = GridPlanner(grid, 0.1, margins=(0.3, 0.04))
    goal = PlanarPose(3.05, 2.05)
    assert planner.plan(START, goal).margin == 0.04
    grid.cells[28:40, 20] = 0
    assert GridPlanner(grid, 0.1, margins=(0.3, 0.04)).plan(START, goal).margin == 0.3


@pytest.mark.parametrize(
    ("goal", "refusal"),
    [
        ((5.0, 1.0), Refusal.GOAL_OUTSIDE),
        ((2.05, 1.0), Refusal.GOAL_BLOCKED),
        ((1.95, 1.0), Refusal.GOAL_TOO_NEAR),
        ((3.0, 1.0), Refusal.UNREACHABLE),
        ((0.55, 3.55), Refusal.GOAL_UNKNOWN),
    ],
)
def test_every_refusal_has_its_name_and_reason(goal, refusal):
    grid = _grid()
    grid.cells[:, 20] = 100
    grid.cells[35, 5] = -1
    answer = GridPlanner(grid, 0.1).plan(START, PlanarPose(*goal))
    assert isinstance(answer, NoPath)
    assert answer.refusal is refusal
    assert answer.reason


def test_a_goal_outside_the_map_is_refused_with_the_maps_bounds():
    grid = OccupancyGrid(np.zeros((40, 40), dtype=np.int8), 0.1, PlanarPose(-1.0, 2.0))
    answer = GridPlanner(grid, 0.1).plan(PlanarPose(0.0, 3.0), PlanarPose(5.0, 3.0))
    assert answer == NoPath(
        Refusal.GOAL_OUTSIDE,
        "the goal is outside the map (x from -1.00 to 3.00 m, y from 2.00 to 6.00 m)",
    )


def test_a_goal_beyond_closed_walls_is_refused_with_where_they_end():
    grid = _grid()
    grid.cells[2, 2:31] = grid.cells[30, 2:31] = grid.cells[2:31, 2] = grid.cells[2:31, 30] = 100
    answer = GridPlanner(grid, 0.1).plan(START, PlanarPose(3.6, 1.0))
    assert answer == NoPath(
        Refusal.GOAL_OUTSIDE,
        "the goal (3.60, 1.00) is outside the walls of the map "
        "(x from 0.20 to 3.10 m, y from 0.20 to 3.10 m), and no path leads out",
    )
    grid.cells[2:31, 15] = 100
    within = GridPlanner(grid, 0.1)
    assert within.plan(START, PlanarPose(2.3, 1.0)).refusal is Refusal.UNREACHABLE


def test_an_impossible_start_is_refused():
    grid = _grid()
    grid.cells[5, 5] = 100
    planner = GridPlanner(grid, 0.1)
    assert planner.plan(START, PlanarPose(2, 2)).refusal is Refusal.START_BLOCKED
    assert planner.plan(PlanarPose(-1, 0), PlanarPose(2, 2)).refusal is Refusal.START_OUTSIDE


def test_a_path_from_too_near_a_wall_first_leaves_the_wall():
    grid = _grid()
    grid.cells[:, 0] = 100
    path = GridPlanner(grid, 0.15, margins=(0.0,)).plan(PlanarPose(0.2, 2.0), PlanarPose(2.0, 2.0))
    assert path.points[0].tolist() == [0.2, 2.0]
    assert path.points[1][0] > 0.2


def test_unknown_ground_can_be_allowed():
    grid = _grid()
    grid.cells[:, 10:] = -1
    goal = PlanarPose(2.0, 2.0)
    assert GridPlanner(grid, 0.1).plan(START, goal).refusal is Refusal.GOAL_UNKNOWN
    assert GridPlanner(grid, 0.1, unknown_is_free=True).plan(START, goal).length > 0


def test_a_radius_and_margins_must_be_lengths():
    with pytest.raises(KbotError):
        GridPlanner(_grid(), -0.1)
    with pytest.raises(KbotError):
        GridPlanner(_grid(), 0.1, margins=())


def test_a_goal_behind_closed_walls_is_refused_without_a_finer_map():
    grid = _grid()
    grid.cells[2, 2:32] = grid.cells[31, 2:32] = grid.cells[2:32, 2] = grid.cells[2:32, 31] = 100
    asked = []
    planner = GridPlanner(grid, 0.2, finer=lambda: asked.append(1) or grid)
    start = PlanarPose(1.0, 1.0)
    assert planner.plan(start, PlanarPose(3.6, 1.0)).refusal is Refusal.GOAL_OUTSIDE
    assert planner.plan(PlanarPose(3.6, 1.0), start).refusal is Refusal.UNREACHABLE
    assert not asked
    grid.cells[10, 31] = 0  # a gap of 0.1 m: it may be wide enough with smaller cells
    assert GridPlanner(grid, 0.2, finer=lambda: asked.append(1) or grid).plan(start, PlanarPose(3.6, 1.0))
    assert asked


def test_a_way_that_large_cells_hide_is_found_with_smaller_cells():
    """A door from y = -0.14 to 0.16 m, with posts that are not on the edges of cells, and no way around
    it."""
    posts = (box("left", (0.1, 2.0, 0.3), 1.02, 1.16), box("right", (0.1, 2.0, 0.3), 1.02, -1.14))
    asked = []

    def grid(resolution):
        asked.append(resolution)
        return world_grid(World("door", posts), resolution, around=((0.0, 0.0), (2.0, 0.0)), margin=0.1)

    start, goal = PlanarPose(0.0, 0.0), PlanarPose(2.0, 0.0)
    assert isinstance(GridPlanner(grid(0.1), 0.13).plan(start, goal), NoPath)
    planner = GridPlanner(grid(0.1), 0.13, finer=lambda: grid(0.005))
    path = planner.plan(start, goal)
    assert isinstance(path, Path)
    assert path.length == pytest.approx(2.0, abs=0.02)
    assert isinstance(planner.plan(goal, start), Path)
    assert asked == [0.1, 0.1, 0.005]
    # a robot with a radius of more than half the door's width does not fit through it
    assert isinstance(GridPlanner(grid(0.1), 0.151, finer=lambda: grid(0.005)).plan(start, goal), NoPath)
