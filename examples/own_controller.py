"""A controller of one's own: along a wall on the left, by lidar.

python examples/own_controller.py             in simulation, as fast as the machine can
python examples/own_controller.py --robot     the robot that is there: a KBot that runs on this machine
                                              (kbot sim kbot lidar:=true --world corridor), or one on ROS
"""

import sys

import kbot
from kbot.navigation import LidarPoints, Observation, Pilot, twist
from kbot.ros.client.pilot import NodePilot
from kbot.sensors.declared import mount_declared

WANTED = 0.3
"""Metres from the wall."""


class AlongTheWall:
    def update(self, observation: Observation) -> kbot.messages.Twist:
        points = observation.obstacles
        if points is None:
            return twist(0.0, 0.0)
        left = points[(points[:, 1] > 0.0) & (abs(points[:, 0]) < 0.3)]
        if not len(left):
            return twist(0.15, 0.3)
        ahead = left[left[:, 0] > 0.0]
        nearest = (ahead if len(ahead) else left)[:, 1].min()
        return twist(0.2, 3.0 * (nearest - WANTED))


def in_simulation() -> None:
    sim = kbot.Simulation(kbot.load("kbot", lidar=True), world="corridor:width=1.2")
    sensors, _ = mount_declared(sim)
    Pilot(sim, AlongTheWall(), seen=LidarPoints(sensors["lidar"]))
    sim.run(12.0)
    pose = sim.ground_truth.pose
    print(f"after 12 s: x {pose.x:.2f} m, {0.59 - pose.y:.3f} m from the wall on the left")


def on_a_robot() -> None:
    node = kbot.Node("wall_follower")
    pilot = NodePilot(node, AlongTheWall())
    node.spin(float(node.param("seconds", 12.0)))
    pilot.close()


if __name__ == "__main__":
    if "--robot" in sys.argv:
        on_a_robot()
    else:
        in_simulation()
