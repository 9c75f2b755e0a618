"""Drive about, and turn away from every wall."""

from kbot import Simulation
from kbot.sensors import Lidar


def drive(sim: Simulation) -> None:
    lidar = sim.add_sensor(Lidar(link="base_link", rate=20))
    while sim.time < 30.0:
        sim.run(0.05)
        ahead = min(lidar.latest.sector(-0.5, 0.5))  # m; within 0.5 rad of straight ahead
        sim.plot("ahead", ahead)
        if ahead > 0.4:
            sim.cmd_vel(0.3, 0.0)
        else:
            sim.cmd_vel(0.0, 1.0)
