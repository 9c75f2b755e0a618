"""Follow the wall on the left, 0.4 m away from it, with a lidar.

kbot sim kbot --world rooms:columns=1,rows=1,size=3 --script wall_follower.py

The robot looks for the nearest point on its left half. If it is exactly to the left, the robot drives along
the wall. If it is further ahead, the robot turns away from it, and if it is further back, towards it.
"""

from math import radians

import numpy as np

from kbot import Simulation
from kbot.messages import LaserScan
from kbot.sensors import Lidar

DISTANCE = 0.4  # from the lidar to the wall, in m
SPEED = 0.25  # m/s


def follow(scan: LaserScan) -> tuple[float, float]:
    """The speed in m/s and the turning speed in rad/s for a scan."""
    angles = scan.angle_min + scan.angle_increment * np.arange(len(scan.ranges))
    left = (angles > radians(-20)) & (angles < radians(150))
    nearest = np.argmin(scan.ranges[left])
    distance, bearing = scan.ranges[left][nearest], angles[left][nearest]
    off = float(np.clip(distance - DISTANCE, -0.3, 0.3))
    aim = bearing - radians(90) + 2.5 * off  # where to steer: along the wall, and towards its distance
    return SPEED * max(0.0, 1.0 - abs(aim)), 2.0 * float(aim)


def drive(sim: Simulation) -> None:
    lidar = sim.add_sensor(Lidar(link="base_link", rate=20))
    while sim.time < 70.0:
        sim.run(0.05)
        sim.cmd_vel(*follow(lidar.latest))
        sim.plot("wall", min(lidar.latest.sector(radians(-20), radians(150))))
