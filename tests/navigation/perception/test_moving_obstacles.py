"""Obstacles that move are found with their velocity, and nothing else is."""

import math

import numpy as np
import pytest

from kbot.messages import Header, Time
from kbot.messages.sensing import LaserScan
from kbot.navigation.perception.moving_obstacles import MovingObstacles
from kbot.navigation.perception.rolling_grid import SensorPlace

RATE, COUNT = 20.0, 360
POSTS = [(3.5, 2.0), (2.5, -1.5), (-1.0, 1.5), (1.0, -1.5)]


def _scan(time, place, discs, face=None):
    """A scan of discs with a radius of 0.2 m, and of a face at x = 1 m: 0.46 m wide, around y = `face`."""
    step = 2.0 * math.pi / COUNT
    angles = place.yaw + place.side * (np.arange(COUNT) * step - math.pi)
    ranges = np.full(COUNT, np.inf)
    for x, y in discs:
        along = (x - place.x) * np.cos(angles) + (y - place.y) * np.sin(angles)
        across = (y - place.y) * np.cos(angles) - (x - place.x) * np.sin(angles)
        hit = (np.abs(across) < 0.2) & (along > 0.0)
        ranges[hit] = np.minimum(ranges[hit], along[hit] - np.sqrt(0.04 - across[hit] ** 2))
    if face is not None:
        ahead = np.maximum(np.cos(angles), 1e-9)
        distance = (1.0 - place.x) / ahead
        hit = np.abs(place.y + distance * np.sin(angles) - face) < 0.23
        ranges[hit] = np.minimum(ranges[hit], distance[hit])
    stamp = Time.from_nanoseconds(round(time * 1e9))
    return LaserScan(
        Header(stamp, "lidar"),
        -math.pi,
        math.pi - step,
        step,
        0.0,
        0.05,
        0.05,
        8.0,
        ranges.astype(np.float32),
    )


def _watch(way, seconds=1.0, speed=0.0, side=1.0):
    """The obstacles that a robot detects which drives at `speed` beside posts and a disc on its way."""
    watch = MovingObstacles()
    for number in range(round(seconds * RATE)):
        time = number / RATE
        place = SensorPlace(speed * time, 0.0, 0.3, side)
        watch.add(_scan(time, place, [*POSTS, way(time)]), place)
    return watch.obstacles


@pytest.mark.parametrize("side", [1.0, -1.0])
@pytest.mark.parametrize("velocity", [(0.0, 0.8), (-1.0, 0.0), (-0.4, -0.4)])
def test_a_disc_that_moves_is_found_with_its_velocity(velocity, side):
    start = 2.0 - velocity[0], 0.3 - velocity[1]
    found = _watch(lambda time: (start[0] + velocity[0] * time, start[1] + velocity[1] * time), side=side)
    assert len(found) == 1
    assert (found[0].vx, found[0].vy) == pytest.approx(velocity, abs=0.2)
    assert (found[0].x, found[0].y) == pytest.approx((2.0, 0.3), abs=0.25)
    assert 0.1 < found[0].radius < 0.3


def test_a_face_that_slides_along_itself_is_found():
    # of its 0.46 m, only the 0.15 m by which it slides in 0.3 s were free before
    watch, place = MovingObstacles(), SensorPlace(0.0, 0.0, 0.3)
    for number in range(20):
        watch.add(_scan(number / RATE, place, POSTS, -0.25 + 0.5 * number / RATE), place)
    (found,) = watch.obstacles
    assert (found.vx, found.vy) == pytest.approx((0.0, 0.5), abs=0.1)


def test_what_stands_does_not_move_from_wherever_it_is_seen():
    assert _watch(lambda time: (3.0, 0.3), seconds=1.5, speed=1.0) == []


def test_an_obstacle_that_stops_is_forgotten():
    found = _watch(lambda time: (2.0, -0.5 + min(0.8 * time, 0.8)), seconds=2.5)
    assert found == []
