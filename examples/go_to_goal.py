"""Plan a path through a maze, and follow it to a goal.

kbot sim kbot --world maze:size=5,seed=2 --script go_to_goal.py
"""

from math import degrees, pi

import kbot
from kbot.navigation import go_to

GOAL = kbot.PlanarPose(2.4, 2.4, pi / 2)  # x and y in m, heading in rad


def drive(sim: kbot.Simulation) -> None:
    sim.draw.points("goal", [(GOAL.x, GOAL.y)], "green", size=0.1)
    trip = go_to(sim, GOAL)
    print(f"{trip.state} after {trip.time:.1f} s")
    print(f"{trip.distance:.2f} m driven, {trip.shortest:.2f} m planned")
    print(f"{1e3 * trip.off:.1f} mm and {degrees(trip.turned_off):.1f} degrees from the goal")
    print(f"odometry is {1e3 * trip.odometry_error:.2f} mm off")
    assert trip.reached
