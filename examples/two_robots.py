"""A second robot follows the first, 0.4 m behind it, with its own lidar.

kbot sim kbot --world empty --script two_robots.py
"""

from math import radians

import numpy as np

from kbot import Simulation, load
from kbot.sensors import Lidar

GAP = 0.4  # from the lidar to the first robot, in m


def drive(sim: Simulation) -> None:
    follower = sim.models.spawn_model(load("kbot"), "follower", x=-0.6)
    lidar = sim.add_sensor(Lidar(link="base_link", robot="follower", rate=20, range_max=2.0))
    while sim.time < 40.0:
        sim.cmd_vel(0.2, 0.4 * np.sin(0.3 * sim.time))  # the first robot drives in curves
        sim.run(0.05)
        scan = lidar.latest
        angles = scan.angle_min + scan.angle_increment * np.arange(len(scan.ranges))
        ahead = abs(angles) < radians(80)
        nearest = np.argmin(scan.ranges[ahead])
        distance, bearing = float(scan.ranges[ahead][nearest]), float(angles[ahead][nearest])
        if np.isfinite(distance):
            sim.plot("gap", distance)
            follower.cmd_vel(float(np.clip(0.2 + 2.0 * (distance - GAP), 0.0, 0.5)), 2.0 * bearing)
        else:
            follower.cmd_vel(0.0, 0.0)  # the first robot is out of sight
