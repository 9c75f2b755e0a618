"""How surely and how directly goals are reached, and what a plan and a tick cost.

    python benchmarks/bench_navigation.py [COUNT]

KBot drives through COUNT seeded mazes and COUNT seeded furnished rooms (100 each), by the map alone and with
a lidar that stops it before whatever it sees. Reachable are the goals to which a flood over the map leads, as
wide as the robot's turning circle; the shortest time is that of the planned path at full speed, turns on the
spot not counted.
"""

from __future__ import annotations

import math
import statistics
import sys
import time
from collections.abc import Callable
from typing import Any

import numpy as np

from kbot.kinematics import PlanarPose, PlanarTwist, Transform
from kbot.model import Robot
from kbot.model.load import load_robot
from kbot.navigation.controller import Observation
from kbot.navigation.footprint import outline
from kbot.navigation.inflation import inflate
from kbot.navigation.obstacle_guard import ObstacleGuard
from kbot.navigation.path import Path
from kbot.navigation.planner import GridPlanner
from kbot.navigation.pure_pursuit import RegulatedPurePursuit
from kbot.navigation.simulated import LidarPoints, Trip, go_to
from kbot.sensors import Contact, Lidar
from kbot.sim import Simulation
from kbot.world import World, load_world
from kbot.world.builders import WOOD, box
from kbot.world.occupancy import OccupancyGrid
from kbot.world.occupancy_of_world import world_grid

LIDAR = Lidar(link="base_link", pose=Transform.from_xyz_rpy((0, 0, 0.06), (0, 0, 0)), rate=20.0)


def maze(seed: int) -> tuple[World, PlanarPose]:
    """A maze of 5 x 5 cells, and the middle of a cell drawn by seed."""
    random = np.random.default_rng(seed)
    x, y = (int(v) for v in random.integers(1, 5, 2))
    return load_world(f"maze:size=5,seed={seed}"), PlanarPose(0.6 * x, 0.6 * y, float(random.uniform(-3, 3)))


def rooms(seed: int) -> tuple[World, PlanarPose]:
    """Rooms whose number, size and doors are drawn by seed, boxes strewn about; a goal anywhere free."""
    random = np.random.default_rng(1000 + seed)
    columns, rows = (int(v) for v in random.integers(2, 4, 2))
    size, door = float(random.uniform(1.6, 2.4)), float(random.uniform(0.4, 0.7))
    bare = load_world(f"rooms:columns={columns},rows={rows},size={size},door={door}")
    boxes = []
    for number in range(2 * columns * rows):
        x, y = random.uniform(-0.4, columns - 0.6) * size, random.uniform(-0.4, rows - 0.6) * size
        if math.hypot(x, y) > 0.5:
            wide = (*random.uniform(0.05, 0.25, 2).tolist(), 0.25)
            boxes.append(box(f"box{number}", wide, x, y, yaw=float(random.uniform(0, 3)), rgba=WOOD))
    world = World("rooms", (*bare.bodies, *boxes))
    free = standing_room(world)
    while True:
        x, y = random.uniform(-0.4, columns - 0.6) * size, random.uniform(-0.4, rows - 0.6) * size
        if free.value(x, y) == 0 and math.hypot(x, y) > 0.5:
            return world, PlanarPose(float(x), float(y), float(random.uniform(-3, 3)))


def standing_room(world: World) -> OccupancyGrid:
    """Where KBot can stand with any heading, and 2 cm to spare."""
    grid = world_grid(world)
    taken = inflate(grid.cells == 100, (0.128 + 0.02) / grid.resolution + 0.5)
    return OccupancyGrid(np.where(taken, 100, 0).astype(np.int8), grid.resolution, grid.origin)


def is_reachable(world: World, goal: PlanarPose) -> bool:
    """Whether a way as wide as KBot leads there: by a flood over the map, no planner asked."""
    grid = world_grid(world)
    free = ~inflate(grid.cells == 100, 0.128 / grid.resolution)
    waiting, last = [grid.cell(0.0, 0.0)], grid.cell(goal.x, goal.y)
    while waiting:
        row, column = waiting.pop()
        if (row, column) == last:
            return True
        if grid.contains(row, column) and free[row, column]:
            free[row, column] = False
            waiting += [(row + 1, column), (row - 1, column), (row, column + 1), (row, column - 1)]
    return False


def drive(robot: Robot, world: World, goal: PlanarPose, with_lidar: bool) -> tuple[Trip, bool]:
    simulation = Simulation(robot, world)
    touches = []
    bumper = simulation.add_sensor(Contact(link="base_link", everywhere=True, rate=250.0))
    simulation.bus.subscribe("bumper", bumper.message_type, lambda m: touches.append(m.data))
    trip = go_to(simulation, goal, lidar=simulation.add_sensor(LIDAR) if with_lidar else None)
    return trip, any(touches)


def table(count: int, with_lidar: bool) -> None:
    robot = load_robot("kbot").require()
    print(f"KBot, {count} of each, {'with' if with_lidar else 'without'} lidar")
    print("world   reachable reached untouched  time/shortest  off_mm max_mm  wall_s  what failed and why")
    for name, make in (("mazes", maze), ("rooms", rooms)):
        begun, trips, failures = time.perf_counter(), [], []
        for seed in range(count):
            world, goal = make(seed)
            trip, touched = drive(robot, world, goal, with_lidar)
            can = is_reachable(world, goal)
            trips.append((trip, touched, can))
            if not trip.reached and not can:
                failures.append(f"{seed}: no way is there, and was {trip.status}")
            elif not trip.reached or touched:
                failures.append(f"{seed}: {trip.status}{' (touched)' if touched else ''}")
        reached = [(t, touched) for t, touched, _ in trips if t.reached]
        times = [t.time / (t.shortest / 0.3) for t, _ in reached if t.shortest > 0.3]
        off = [1e3 * math.hypot(t.pose.x - t.status.goal.x, t.pose.y - t.status.goal.y) for t, _ in reached]
        untouched = sum(not touched for _, touched in reached)
        reachable = sum(can for *_, can in trips)
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
    """1000 x 1000 cells of 0.05 m, one way that goes to and fro fifty times."""
    cells = np.zeros((1000, 1000), dtype=np.int8)
    for at in range(1, 50):
        cells[at * 20, :-17] = 100
        if at % 2:
            cells[at * 20] = cells[at * 20, ::-1]
    return OccupancyGrid(cells, 0.05)


def best(work: Callable[[], Any], repeats: int) -> float:
    """Milliseconds of processor time of the quickest of several runs."""
    times = []
    for _ in range(repeats):
        begun = time.process_time()
        work()
        times.append(time.process_time() - begun)
    return 1e3 * min(times)


def costs() -> None:
    """What a plan over a million cells and a tick of the control loop cost, beside their limits."""
    start, goal = PlanarPose(0.6, 0.5), PlanarPose(49.4, 49.5)
    print("what                                                    ms   limit")
    for name, grid, radius in (("200 boxes", large_grid(), 0.3), ("serpentine", serpentine(), 0.2)):
        planner = GridPlanner(grid, radius, margins=(0.1,))
        first = best(lambda p=planner: p.plan(start, goal), 1)
        again = best(lambda p=planner: p.plan(start, goal), 5)
        print(f"first plan on 1000 x 1000, {name:10s} (makes tables) {first:9.1f}")
        print(f"every further plan, {name:10s}                       {again:9.2f}      50")
    print(f"one tick of pursuit behind the guard                {tick():9.3f}       1")


def tick() -> float:
    robot = load_robot("kbot").require()
    simulation = Simulation(robot, "maze:size=8")
    seen = LidarPoints(simulation.add_sensor(LIDAR))
    simulation.run(0.1)
    points, _ = seen()
    path = Path.through([(0.0, 0.0), (0.1, 0.0), (0.3, 0.1)])
    guard = ObstacleGuard(RegulatedPurePursuit(path, proximity=0.3), outline(robot))
    observation = Observation(0.0, PlanarPose(), PlanarTwist(0.3), points, 0.0)
    return best(lambda: guard.update(observation), 200)


if __name__ == "__main__":
    numbers = [int(word) for word in sys.argv[1:] if word.isdigit()]
    costs()
    for with_lidar in (False, True):
        print()
        table(numbers[0] if numbers else 100, with_lidar)
