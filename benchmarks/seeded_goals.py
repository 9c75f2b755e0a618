"""Seeded worlds with navigation goals: mazes and furnished rooms."""

from __future__ import annotations

import math

import numpy as np

from kbot.kinematics import PlanarPose, Transform
from kbot.model import RobotModel
from kbot.navigation.controller import GENTLE
from kbot.navigation.simulated.trip import Trip
from kbot.navigation.space.distance_field import inflate
from kbot.navigation.with_map.go_to import go_to
from kbot.sensors import Lidar
from kbot.sim import Simulation
from kbot.world import World, load_world
from kbot.world.builders import WOOD, box
from kbot.world.occupancy import OccupancyGrid
from kbot.world.occupancy_of_world import world_grid

LIDAR = Lidar(link="base_link", pose=Transform.from_xyz_rpy((0, 0, 0.06), (0, 0, 0)), rate=20.0)


def maze(seed: int) -> tuple[World, PlanarPose]:
    """A maze of 5 x 5 cells, with the centre of a random cell as goal."""
    random = np.random.default_rng(seed)
    x, y = (int(v) for v in random.integers(1, 5, 2))
    return load_world(f"maze:size=5,seed={seed}"), PlanarPose(0.6 * x, 0.6 * y, float(random.uniform(-3, 3)))


def rooms(seed: int) -> tuple[World, PlanarPose]:
    """Rooms of random number, size and door width with boxes at random places, and a random free goal."""
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
    """The free cells where KBot fits with any heading and a margin of 2 cm."""
    grid = world_grid(world)
    taken = inflate(grid.cells == 100, (0.128 + 0.02) / grid.resolution + 0.5)
    return OccupancyGrid(np.where(taken, 100, 0).astype(np.int8), grid.resolution, grid.origin)


def is_reachable(world: World, goal: PlanarPose) -> bool:
    """Whether a flood fill of the map, as wide as KBot, reaches the goal. It does not use the planner."""
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


def drive(robot: RobotModel, world: World, goal: PlanarPose, with_lidar: bool) -> Trip:
    simulation = Simulation(robot, world)
    return go_to(simulation, goal, lidar=simulation.add_sensor(LIDAR) if with_lidar else None)


def time_ratio(trip: Trip) -> float:
    """The time of a trip as a multiple of the time of its planned path at full speed."""
    return trip.time / (trip.shortest / GENTLE.linear)
