"""Success rate and efficiency of navigation goals, and the time of a plan and of a control tick.

    python benchmarks/bench_navigation.py [COUNT]

KBot drives through 100 seeded mazes and 100 seeded furnished rooms, once with the map only and once with a
lidar that stops it in front of obstacles. A goal is reachable if a flood fill of the map, with the robot's
turning circle as width, reaches it. The shortest time is that of the planned path at full speed, without
turns on the spot.

COUNT is the number of mazes and of rooms, 100 by default.
"""

from __future__ import annotations

import statistics
import sys
import time
from collections.abc import Callable
from typing import Any

import numpy as np
from seeded_goals import LIDAR, drive, is_reachable, maze, rooms, time_ratio

from kbot.kinematics import PlanarPose, PlanarTwist
from kbot.model.load import load_robot
from kbot.navigation.controller import Observation
from kbot.navigation.followers.obstacle_guard import ObstacleGuard
from kbot.navigation.followers.pure_pursuit import RegulatedPurePursuit
from kbot.navigation.path import Path
from kbot.navigation.planning.grid_planner import GridPlanner
from kbot.navigation.simulated.lidars import LidarPoints
from kbot.navigation.space.footprint import outline
from kbot.sim import Simulation
from kbot.world.occupancy import OccupancyGrid


def table(count: int, with_lidar: bool) -> None:
    robot = load_robot("kbot").require()
    print(f"KBot, {count} of each, {'with' if with_lidar else 'without'} lidar")
    print("world   reachable reached untouched  time/shortest  off_mm max_mm  wall_s  failures")
    for name, make in (("mazes", maze), ("rooms", rooms)):
        begun, trips, failures = time.perf_counter(), [], []
        for seed in range(count):
            world, goal = make(seed)
            trip = drive(robot, world, goal, with_lidar)
            can = is_reachable(world, goal)
            trips.append((trip, can))
            if not trip.reached and not can:
                failures.append(f"{seed}: unreachable, and {trip.status}")
            elif not trip.reached or trip.collided:
                failures.append(f"{seed}: {trip.status}{' (collided)' if trip.collided else ''}")
        reached = [trip for trip, _ in trips if trip.reached]
        times = [time_ratio(trip) for trip in reached if trip.shortest > 0.3]
        off = [1e3 * trip.off for trip in reached]
        untouched = sum(not trip.collided for trip in reached)
        reachable = sum(can for _, can in trips)
        print(
            f"{name:7s} {reachable:9d} {len(reached):7d} {untouched:9d} {statistics.median(times):14.2f}"
            f" {statistics.median(off):7.1f} {max(off):6.1f} {time.perf_counter() - begun:7.1f}"
        )
        for failure in failures:
            print(f"        {failure}")


def large_grid() -> OccupancyGrid:
    """1000 x 1000 cells of 0.05 m with 200 boxes."""
    random = np.random.default_rng(1)
    cells = np.zeros((1000, 1000), dtype=np.int8)
    for _ in range(200):
        (x, y), (w, h) = random.integers(30, 930, 2), random.integers(10, 60, 2)
        cells[y : y + h, x : x + w] = 100
    return OccupancyGrid(cells, 0.05)


def serpentine() -> OccupancyGrid:
    """1000 x 1000 cells of 0.05 m with one path that goes back and forth fifty times."""
    cells = np.zeros((1000, 1000), dtype=np.int8)
    for at in range(1, 50):
        cells[at * 20, :-17] = 100
        if at % 2:
            cells[at * 20] = cells[at * 20, ::-1]
    return OccupancyGrid(cells, 0.05)


def best(work: Callable[[], Any], repeats: int) -> float:
    """The minimum processor time of several runs, in ms."""
    times = []
    for _ in range(repeats):
        begun = time.process_time()
        work()
        times.append(time.process_time() - begun)
    return 1e3 * min(times)


def costs() -> None:
    """Print the time of a plan over a million cells and of a control tick, with their limits."""
    start, goal = PlanarPose(0.6, 0.5), PlanarPose(49.4, 49.5)
    print("measured                                                ms   limit")
    for name, grid, radius in (("200 boxes", large_grid(), 0.3), ("serpentine", serpentine(), 0.2)):
        planner = GridPlanner(grid, radius, margins=(0.1,))
        first = best(lambda p=planner: p.plan(start, goal), 1)
        again = best(lambda p=planner: p.plan(start, goal), 5)
        print(f"first plan on 1000 x 1000, {name:10s} (builds tables){first:9.1f}")
        print(f"every further plan, {name:10s}                       {again:9.2f}      50")
    print(f"one tick of pursuit with obstacle guard             {tick():9.3f}       1")


def tick() -> float:
    robot = load_robot("kbot").require()
    simulation = Simulation(robot, "maze:size=8")
    seen = LidarPoints(simulation.add_sensor(LIDAR))
    simulation.run(0.1)
    points, _ = seen()
    path = Path.through([(0.0, 0.0), (0.1, 0.0), (0.3, 0.1)])
    guard = ObstacleGuard(RegulatedPurePursuit(path, proximity=0.3), outline(robot, "base_footprint"))
    observation = Observation(0.0, PlanarPose(), PlanarTwist(0.3), points, 0.0)
    return best(lambda: guard.update(observation), 200)


if __name__ == "__main__":
    numbers = [int(word) for word in sys.argv[1:] if word.isdigit()]
    costs()
    for with_lidar in (False, True):
        print()
        table(numbers[0] if numbers else 100, with_lidar)
