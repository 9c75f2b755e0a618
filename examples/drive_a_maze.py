"""Drive KBot through a maze to a goal, and write the maze as a map for ROS.

python examples/drive_a_maze.py
"""

import math
import tempfile
from pathlib import Path

import kbot
from kbot.navigation import go_to
from kbot.world.occupancy_files import write_map
from kbot.world.occupancy_of_world import world_grid

sim = kbot.Simulation(kbot.load("kbot"), world="maze:size=5,seed=2")
grid = world_grid(sim.world)
write_map(grid, Path(tempfile.mkdtemp()) / "maze.yaml")

goal = kbot.PlanarPose(2.4, 2.4, math.pi / 2)
trip = go_to(sim, goal, grid)
print(f"{trip.state} after {trip.time:.1f} s and {trip.distance:.2f} m of {trip.shortest:.2f} m planned")
print(f"{1e3 * math.hypot(trip.pose.x - goal.x, trip.pose.y - goal.y):.1f} mm from the goal")
print(f"odometry is {1e3 * trip.odometry_error:.2f} mm off the truth")
