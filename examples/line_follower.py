"""Follow a line on the floor with a row of five light sensors.

kbot sim kbot --world track --script line_follower.py

Each sensor reads 0 on black and 1 on white. The line is in the middle of the sensors that see black. The
robot turns towards it.
"""

import numpy as np

from kbot import Simulation, Transform
from kbot.sensors import Line

SPEED = 0.3  # m/s
GAIN = 60.0  # rad/s for each metre between the line and the middle of the sensors


def drive(sim: Simulation) -> None:
    at_the_front = Transform.from_xyz_rpy((0.08, 0.0, 0.0), (0.0, 0.0, 0.0))
    eyes = sim.add_sensor(Line(link="base_link", pose=at_the_front, eyes=5, spacing=0.01))
    left_of_middle = np.array([0.02, 0.01, 0.0, -0.01, -0.02])  # m
    line = 0.0
    while sim.time < 31.0:
        sim.run(0.02)
        sees_black = np.array(eyes.measure().data) < 0.5
        if sees_black.any():  # else turn to where the line was last
            line = float(left_of_middle[sees_black].mean())
        sim.cmd_vel(SPEED, GAIN * line)
        sim.plot("line", line)
