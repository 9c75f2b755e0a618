"""Drive about, draw a map of what the lidar sees, and save it for ROS as map.yaml and map.png.

kbot sim kbot --world rooms:columns=2,rows=1 --script draw_a_map.py

Each beam of the lidar votes: the cells that it crosses are free, the cell where it ends is occupied. The
majority decides. The robot knows where it is from its odometry.
"""

import numpy as np
from obstacle_avoidance import Avoider  # the example beside this one

from kbot import PlanarPose, Simulation
from kbot.sensors import Lidar, scan_points
from kbot.world import OccupancyGrid, write_map

CELL = 0.05  # m
SIZE = 160  # cells along x and along y: 8 m
CORNER = -4.0  # x and y of the map's corner, in m


def mark(points: np.ndarray) -> np.ndarray:
    """A map (rows along y, columns along x) that is true in the cells of points (n, 2) in m."""
    columns, rows = np.floor((points - CORNER) / CELL).astype(int).T
    marked = np.zeros((SIZE, SIZE), bool)
    marked[rows, columns] = True
    return marked


def drive(sim: Simulation) -> None:
    lidar = sim.add_sensor(Lidar(link="base_link", rate=10, range_max=3.0))
    base_from_lidar = sim.link_pose("base_footprint").inverse() @ sim.link_pose("base_link")
    votes, avoider = np.zeros((SIZE, SIZE), int), Avoider()
    shares = np.linspace(0.0, 1.0, 60)[:, None, None]  # points along each beam, at most a cell apart
    while sim.time < 60.0:
        sim.run(0.1)
        sim.cmd_vel(*avoider.decide(lidar.latest))
        ends = scan_points(lidar.latest, base_from_lidar.matrix)
        robot = sim.odometry.pose
        occupied = mark(robot.apply(ends))
        crossed = mark(robot.apply((shares * ends).reshape(-1, 2))) & ~occupied
        votes += 1 * occupied - 1 * crossed
        sim.draw.points("map", (np.argwhere(votes > 0)[:, ::-1] + 0.5) * CELL + CORNER, "red", 0.02)
    cells = np.select([votes > 0, votes < 0], [100, 0], -1).astype(np.int8)  # occupied, free, unknown
    write_map(OccupancyGrid(cells, CELL, PlanarPose(CORNER, CORNER)), "map.yaml")
    print(f"map.yaml: {np.mean(cells >= 0):.0%} of the map is known")
