"""Write your own controller: follow a wall on the left with the lidar.

python examples/own_controller.py             in a simulation, as fast as possible
python examples/own_controller.py --robot     on a running robot: a KBot on this machine
                                              (kbot sim kbot lidar:=true --world corridor), or a robot on ROS
"""

import sys

import kbot
from kbot.navigation import LidarPoints, Observation, Pilot, twist
from kbot.ros.client.pilot import NodePilot
from kbot.sensors.declared import mount_declared

TARGET_DISTANCE = 0.3
"""Metres between the robot and the wall."""


class WallFollower:
    def update(self, observation: Observation) -> kbot.messages.Twist:
        points = observation.obstacles
        if points is None:
            return twist(0.0, 0.0)
        left = points[(points[:, 1] > 0.0) & (abs(points[:, 0]) < 0.3)]
        if not len(left):
            return twist(0.15, 0.3)
        ahead = left[left[:, 0] > 0.0]
        nearest = (ahead if len(ahead) else left)[:, 1].min()
        return twist(0.2, 3.0 * (nearest - TARGET_DISTANCE))


def in_simulation() -> None:
    sim = kbot.Simulation(kbot.load("kbot", lidar=True), world="corridor:width=1.2")
    sensors, _ = mount_declared(sim)
    Pilot(sim, WallFollower(), seen=LidarPoints(sensors["lidar"]))
    sim.run(12.0)
    pose = sim.ground_truth.pose
    print(f"after 12 s: x {pose.x:.2f} m, {0.59 - pose.y:.3f} m from the wall on the left")


def on_a_robot() -> None:
    node = kbot.Node("wall_follower")
    pilot = NodePilot(node, WallFollower())
    node.spin(float(node.param("seconds", 12.0)))
    pilot.close()


if __name__ == "__main__":
    try:
        if "--robot" in sys.argv:
            on_a_robot()
        else:
            in_simulation()
    except kbot.KbotError as error:  # no KBot is running, or several are, or it has stopped
        print(f"error: {error}", file=sys.stderr)
        sys.exit(2)
