"""Write your own controller, and run it in a simulation or on a robot: follow the wall on the left.

kbot sim kbot --world corridor:width=1.2 --script own_controller.py     in a simulation
python own_controller.py                                                on a robot

The robot is a KBot that runs on this machine (kbot sim kbot lidar:=true --world corridor), or a robot with
ROS 1 or ROS 2 that has the topics odom, scan and cmd_vel.
"""

import sys

import kbot
from kbot.navigation import LidarPoints, Observation, Pilot, twist
from kbot.ros import NodePilot
from kbot.sensors import Lidar

DISTANCE = 0.3  # from the robot's middle to the wall, in m


class WallFollower:
    """Called 50 times a second (20 times on a robot) with what the robot knows. Returns its speeds."""

    def update(self, observation: Observation) -> kbot.messages.Twist:
        points = observation.obstacles  # x and y in m in the robot's frame: x forward, y left
        if points is None:
            return twist(0.0, 0.0)  # no scan yet
        beside = points[(points[:, 1] > 0.0) & (abs(points[:, 0]) < 0.3)]
        if not len(beside):
            return twist(0.15, 0.3)  # look for a wall
        ahead = beside[beside[:, 0] > 0.0]
        nearest = (ahead if len(ahead) else beside)[:, 1].min()
        return twist(0.2, 3.0 * (nearest - DISTANCE))


def drive(sim: kbot.Simulation) -> None:
    lidar = sim.add_sensor(Lidar(link="base_link"))
    Pilot(sim, WallFollower(), seen=LidarPoints(lidar))
    sim.run(12.0)


def main() -> None:
    node = kbot.Node("wall_follower")
    pilot = NodePilot(node, WallFollower())
    node.spin(float(node.param("seconds", 12.0)))
    pilot.close()


if __name__ == "__main__":
    try:
        main()
    except kbot.KbotError as error:  # no KBot is running, or several are
        print(f"error: {error}", file=sys.stderr)
        sys.exit(2)
