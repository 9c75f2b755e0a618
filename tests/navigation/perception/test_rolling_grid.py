"""The rolling grid shows what lidars detect, and keeps it while it moves."""

import math

import numpy as np
import pytest

from kbot.kinematics import PlanarPose, Transform
from kbot.messages import Header
from kbot.messages.sensing import LaserScan
from kbot.navigation.perception.rolling_grid import RollingGrid, SensorPlace

HERE = SensorPlace(0.0, 0.0, 0.0)


def _scan(ranges, start=-math.pi / 2, end=math.pi / 2):
    step = (end - start) / (len(ranges) - 1)
    empty = np.empty(0, dtype=np.float32)
    return LaserScan(
        Header(), start, end, step, 0.0, 0.1, 0.1, 10.0, np.array(ranges, dtype=np.float32), empty
    )


def _wall(distance, count=361, **angles):
    """A scan of a wall across the sensor's x axis."""
    start, end = angles.get("start", -math.pi / 2), angles.get("end", math.pi / 2)
    directions = np.cos(np.linspace(start, end, count))
    with np.errstate(divide="ignore"):
        ranges = np.where(directions > 1e-6, distance / directions, np.inf)
    return _scan(np.where(ranges <= 10.0, ranges, np.inf), start, end)


def _is_occupied(grid, x, y):
    column, row = (math.floor(v / grid.resolution) for v in (x - grid.corner[0], y - grid.corner[1]))
    return bool(grid.occupied[row, column])


def test_a_wall_is_occupied_where_beams_end():
    grid = RollingGrid(0.05)
    grid.add(_wall(1.02), HERE)
    for y in (-0.52, -0.02, 0.48):
        assert _is_occupied(grid, 1.02, y)
    assert not _is_occupied(grid, 0.97, 0.0)
    assert not _is_occupied(grid, 1.07, 0.0)


def test_beams_that_pass_through_a_cell_free_it_after_three_scans():
    grid = RollingGrid(0.05)
    grid.add(_wall(1.02), HERE)
    left = []
    for _ in range(3):
        grid.add(_wall(2.02), HERE)
        left.append(_is_occupied(grid, 1.02, -0.02))
    assert left == [True, True, False]
    assert _is_occupied(grid, 2.02, -0.02)


def test_only_the_surfaces_that_a_lidar_sees_are_forgotten():
    grid = RollingGrid(0.05)
    behind = SensorPlace(0.0, 0.0, math.pi)
    grid.add(_wall(1.02), behind)
    grid.add(_wall(3.02), HERE)
    for distance in (1.02, 1.12):  # as if the estimate had moved
        grid.add(_wall(distance), HERE)
    grid.forget_seen(_wall(1.02), HERE)
    assert not _is_occupied(grid, 1.02, -0.02)
    assert not _is_occupied(grid, 1.12, -0.02)
    assert _is_occupied(grid, 3.02, -0.02)
    assert _is_occupied(grid, -1.02, -0.02)


def test_cells_behind_the_wall_and_outside_the_angles_are_kept():
    grid = RollingGrid(0.05)
    grid.add(_wall(2.02), HERE)  # a wall that another one hides from now on
    grid.add(_wall(1.52), SensorPlace(0.0, 0.0, math.pi))  # behind the sensor
    for _ in range(4):
        grid.add(_wall(1.02), HERE)
    assert _is_occupied(grid, 2.02, -0.02)
    assert _is_occupied(grid, -1.52, -0.02)


@pytest.mark.parametrize("roll", [0.0, math.pi])
def test_a_turned_or_upside_down_lidar_is_placed_by_its_pose(roll):
    """The first beam of a lidar that looks left from (0.1, 0) hits at 0.52 m.

    Upside down, it points backwards."""
    base_from_sensor = Transform.from_xyz_rpy((0.1, 0.0, 0.2), (roll, 0.0, math.pi / 2)).matrix
    place = SensorPlace.on_base(PlanarPose(1.0, 2.0, 0.0), base_from_sensor)
    assert place.side == (1.0 if roll == 0.0 else -1.0)
    grid = RollingGrid(0.05)
    grid.add(_scan([0.52] + [math.inf] * 20), place)
    # the beam at -90 degrees of a sensor whose x axis is the base's y axis: base x, or -x if it hangs
    assert _is_occupied(grid, 1.1 + (0.52 if roll == 0.0 else -0.52), 2.01)
    assert grid.occupied.sum() == 1


def test_a_hanging_lidar_frees_the_cells_on_its_own_side():
    hanging = SensorPlace(0.0, 0.0, 0.0, -1.0)
    grid = RollingGrid(0.05)
    grid.add(_wall(1.02, start=-1.0, end=0.0), hanging)  # its angles from -1 to 0 rad are on the left
    assert _is_occupied(grid, 1.02, 0.48)
    assert not _is_occupied(grid, 1.02, -0.48)
    for _ in range(3):
        grid.add(_wall(2.02, start=-1.0, end=0.0), hanging)
    assert not _is_occupied(grid, 1.02, 0.48)


def test_beams_without_a_return_free_cells_and_too_close_ones_do_not():
    grid = RollingGrid(0.05)
    grid.add(_wall(1.02), HERE)
    for _ in range(3):
        grid.add(_scan([-math.inf] * 361), HERE)
    assert _is_occupied(grid, 1.02, -0.02)
    for _ in range(3):
        grid.add(_scan([math.inf] * 361), HERE)
    assert not _is_occupied(grid, 1.02, -0.02)


def test_the_grid_keeps_obstacles_where_they_are_while_it_moves():
    grid = RollingGrid(0.05)
    grid.add(_wall(1.02, start=-1.0, end=1.0), HERE)
    before = grid.occupied.sum()
    grid.center_on(2.0, -1.0)
    assert grid.corner == pytest.approx((2.0 - 6.0, -1.0 - 6.0))
    assert _is_occupied(grid, 1.02, -0.02)
    assert grid.occupied.sum() == before
    grid.center_on(20.0, 0.0)
    assert not grid.occupied.any()
