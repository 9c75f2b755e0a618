"""Paths for bases that steer or drive sideways, with the true outline of the robot."""

import math

import numpy as np
import pytest

from kbot.kinematics import PlanarPose
from kbot.navigation.path import Path
from kbot.navigation.planning.planner import NoPath, Refusal
from kbot.navigation.planning.pose_planner import PosePlanner, holonomic, steered
from kbot.navigation.planning.reeds_shepp import distances
from kbot.navigation.space.distance_field import DistanceField
from kbot.navigation.space.footprint import Outline
from kbot.navigation.space.footprint_clearance import FootprintClearance
from kbot.world.occupancy import OccupancyGrid

CAR = Outline.rectangle(-0.1, 0.4, -0.15, 0.15)
RADIUS = 0.6
LONG = Outline.rectangle(-0.4, 0.4, -0.15, 0.15)
RESOLUTION = 0.05


def _grid(size=6.0, origin=None):
    cells = round(size / RESOLUTION)
    return OccupancyGrid(
        np.zeros((cells, cells), np.int8), RESOLUTION, origin or PlanarPose(-size / 2, -size / 2)
    )


def _fill(grid, left, right, low, high):
    (row, column), (last_row, last_column) = grid.cell(left, low), grid.cell(right - 1e-9, high - 1e-9)
    grid.cells[max(row, 0) : last_row + 1, max(column, 0) : last_column + 1] = 100


def _poses(path):
    return np.column_stack([path.points, path.yaws])


def _arcs(path):
    """The signed lengths and the curvatures of the steps of a path."""
    x, y, turn = np.diff(_poses(path), axis=0).T
    middle = path.yaws[:-1] + turn / 2
    ahead = x * np.cos(middle) + y * np.sin(middle)
    lengths = ahead / np.sinc(turn / (2 * math.pi))
    return lengths, turn / lengths, np.abs(y * np.cos(middle) - x * np.sin(middle))


def _clearance(grid, outline, path):
    occupied = grid.cells == 100
    field = DistanceField.of(occupied, (grid.origin.x, grid.origin.y), RESOLUTION, 2.0)
    return FootprintClearance(outline, 0.02).of(field, *_poses(path).T).min()


@pytest.mark.parametrize("seed", range(6))
def test_in_the_open_a_steered_base_drives_the_reeds_shepp_path(seed):
    random = np.random.default_rng(seed)
    start, goal = (PlanarPose(*random.uniform(-2, 2, 2), random.uniform(-3, 3)) for _ in range(2))
    path = PosePlanner(_grid(), CAR, steered(RADIUS)).plan(start, goal)
    lengths, curvatures, across = _arcs(path)
    assert _poses(path)[0] == pytest.approx([start.x, start.y, start.yaw], abs=1e-6)
    assert path.points[-1] == pytest.approx([goal.x, goal.y])
    assert math.remainder(path.yaws[-1] - goal.yaw, 2 * math.pi) == pytest.approx(0.0, abs=1e-6)
    # never sideways, and never sharper than the radius
    assert across.max() < 1e-6
    assert np.abs(curvatures).max() <= 1.0 / RADIUS + 1e-6
    x, y = start.local(goal.x, goal.y)
    least = RADIUS * distances(
        np.array([x / RADIUS]), np.array([y / RADIUS]), np.array([goal.yaw - start.yaw])
    )
    assert least[0] - 1e-6 <= np.abs(lengths).sum() <= 1.05 * least[0] + 0.1 * RADIUS


def test_a_steered_base_turns_around_in_a_corridor_by_reversing():
    grid = _grid()
    _fill(grid, -3, 3, 0.55, 0.65)
    _fill(grid, -3, 3, -0.65, -0.55)
    path = PosePlanner(grid, CAR, steered(RADIUS)).plan(PlanarPose(), PlanarPose(-0.5, 0.0, math.pi))
    lengths, curvatures, across = _arcs(path)
    assert (lengths < 0.0).any()
    assert (lengths > 0.0).any()
    assert across.max() < 1e-4
    assert np.abs(curvatures).max() <= 1.0 / RADIUS + 1e-4
    assert _clearance(grid, CAR, path) > 0.0


def test_a_goal_without_heading_needs_no_turn():
    planner = PosePlanner(_grid(), CAR, steered(RADIUS))
    free = planner.plan(PlanarPose(), PlanarPose(2.0, 0.0, 2.5), any_heading=True)
    assert free.length == pytest.approx(2.0, abs=1e-6)
    assert planner.plan(PlanarPose(), PlanarPose(2.0, 0.0, 2.5)).length > 2.2


def test_a_holonomic_base_drives_sideways_where_that_is_the_only_way():
    """A base of 0.8 m x 0.3 m passes a slot of 0.5 m along y only if it looks along the slot, or drives
    sideways out of it where the slot is too short to turn."""
    grid = _grid()
    _fill(grid, -3, -0.25, -0.1, 0.1)
    _fill(grid, 0.25, 3, -0.1, 0.1)
    planner = PosePlanner(grid, LONG, holonomic(0.1))
    path = planner.plan(PlanarPose(0, -1.2, math.pi / 2), PlanarPose(0, 1.2, math.pi / 2))
    assert path.length == pytest.approx(2.4, abs=0.02)
    turned = planner.plan(PlanarPose(0, -1.2, 0.0), PlanarPose(0, 1.2, 0.0))
    in_slot = np.abs(turned.points[:, 1]) < 0.1
    assert np.abs(np.cos(turned.yaws[in_slot])).max() < 0.6, "it looks along the slot"
    assert turned.length < 2.6
    assert _clearance(grid, LONG, turned) > 0.0
    # through a corridor along x at which it looks across, as a crab does
    corridor = _grid()
    _fill(corridor, -3, 3, 0.25, 0.35)
    _fill(corridor, -3, 3, -0.35, -0.25)
    crab = PosePlanner(corridor, Outline.rectangle(-0.15, 0.15, -0.4, 0.4), holonomic(0.1))
    path = crab.plan(PlanarPose(-1.5, 0, math.pi / 2), PlanarPose(1.5, 0, math.pi / 2))
    assert np.abs(path.points[:, 1]).max() < 0.02
    assert path.yaws == pytest.approx(math.pi / 2)


def test_an_l_shape_passes_a_post_in_its_corner_that_its_convex_outline_does_not():
    bar, leg = (
        np.array([(-0.6, -0.1), (0.6, -0.1), (0.6, 0.1), (-0.6, 0.1)]),
        np.array([(-0.6, -0.1), (-0.4, -0.1), (-0.4, 0.9), (-0.6, 0.9)]),
    )
    shape = Outline.around([bar, leg])
    assert len(shape.pieces) == 2
    grid = _grid(8.0)
    _fill(grid, 0.0, 0.1, 0.3, 0.4)
    goal = PlanarPose(0.02, 0.0, 0.0)
    inside = PosePlanner(grid, shape, holonomic(0.1)).plan(PlanarPose(1.5, -1.5, 0.0), goal)
    assert isinstance(inside, Path)
    assert _clearance(grid, shape, inside) > 0.0
    around = PosePlanner(grid, Outline(shape.corners), holonomic(0.1)).plan(PlanarPose(1.5, -1.5, 0.0), goal)
    assert isinstance(around, NoPath)
    assert around.refusal is Refusal.GOAL_TOO_NEAR


@pytest.mark.parametrize("moves", [steered(RADIUS), holonomic(0.1)])
def test_refusals_have_a_reason(moves):
    grid = _grid()
    _fill(grid, 1.0, 1.1, -3, 3)
    planner = PosePlanner(grid, CAR, moves)
    for goal, refusal in (
        (PlanarPose(9.0, 0.0), Refusal.GOAL_OUTSIDE),
        (PlanarPose(1.05, 0.0), Refusal.GOAL_BLOCKED),
        (PlanarPose(0.9, 0.0), Refusal.GOAL_TOO_NEAR),
        (PlanarPose(2.0, 0.0), Refusal.UNREACHABLE),
    ):
        assert planner.plan(PlanarPose(), goal).refusal is refusal
    assert planner.plan(PlanarPose(1.05, 0.0), PlanarPose()).refusal is Refusal.START_BLOCKED


def test_a_map_with_a_turned_origin_gives_the_same_path():
    origin = PlanarPose(1.0, -2.0, 0.7)
    straight = PosePlanner(_grid(origin=PlanarPose()), CAR, steered(RADIUS))
    turned = PosePlanner(_grid(origin=origin), CAR, steered(RADIUS))
    start, goal = PlanarPose(1.5, 1.5, 0.3), PlanarPose(4.0, 3.5, -1.0)
    there = turned.plan(origin @ start, origin @ goal)
    assert origin.inverse().apply(there.points) == pytest.approx(straight.plan(start, goal).points, abs=1e-6)


def test_obstacles_that_a_lidar_detected_are_avoided():
    planner = PosePlanner(_grid(), CAR, steered(RADIUS))
    start, goal = PlanarPose(-2.0, 0.0), PlanarPose(2.0, 0.0)
    assert planner.plan(start, goal).length == pytest.approx(4.0, abs=1e-3)
    around = planner.with_obstacles(np.array([[0.0, 0.0], [0.0, 0.05]])).plan(start, goal)
    assert 4.0 < around.length < 4.5
