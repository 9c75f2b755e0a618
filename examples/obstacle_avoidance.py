"""Drive about and avoid everything, with a lidar.

kbot sim kbot --world rooms:columns=2,rows=2 --script obstacle_avoidance.py

If the way ahead is free, the robot drives straight. Otherwise it turns to the side where there is more room,
and keeps turning to that side until the way is free.
"""

import numpy as np

from kbot import Simulation
from kbot.messages import LaserScan
from kbot.sensors import Lidar

SPEED = 0.3  # m/s
CLEARANCE = 0.4  # m ahead at which the robot turns


class Avoider:
    """Decides where to drive. It remembers the side to which it turns."""

    def __init__(self) -> None:
        self._turn = 0.0

    def decide(self, scan: LaserScan) -> tuple[float, float]:
        """The speed in m/s and the turning speed in rad/s for a scan."""
        if min(scan.sector(-0.5, 0.5)) > CLEARANCE:  # rad; 0 is straight ahead, left is positive
            self._turn = 0.0
            return SPEED, 0.0
        if self._turn == 0.0:
            self._turn = 1.0 if room(scan.sector(0.35, 1.4)) > room(scan.sector(-1.4, -0.35)) else -1.0
        return 0.0, self._turn


def room(ranges: np.ndarray) -> float:
    """The mean distance in m. A beam that meets nothing counts as 10 m."""
    return float(np.minimum(ranges, 10.0).mean())


def drive(sim: Simulation) -> None:
    lidar = sim.add_sensor(Lidar(link="base_link", rate=20))
    avoider = Avoider()
    while sim.time < 60.0:
        sim.run(0.05)
        sim.cmd_vel(*avoider.decide(lidar.latest))
