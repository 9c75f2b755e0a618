"""Write your own node: drive in a circle. The same program works with KBot alone, with ROS 1 and with ROS 2.

In one terminal:  kbot sim urdf/my_robot.xacro
In another:       python scripts/circle.py _speed:=0.3
"""

import sys

import kbot
from kbot.messages import Odometry, Twist, Vector3


def main() -> None:
    node = kbot.Node("circle")
    speed = node.param("speed", 0.2)

    def print_position(odometry: Odometry) -> None:
        position = odometry.pose.pose.position
        print(f"\r{node.now:8.2f} s   x {position.x:6.3f} m   y {position.y:6.3f} m", end="", flush=True)

    node.subscribe("odom", Odometry, print_position)
    node.every(0.1, lambda: node.publish("cmd_vel", Twist(Vector3(speed), Vector3(0.0, 0.0, 0.5))))
    node.spin()


try:
    main()
except kbot.KbotError as error:  # no KBot is running, or several are, or it has stopped
    print(f"error: {error}", file=sys.stderr)
    sys.exit(2)
