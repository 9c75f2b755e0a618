"""A node of one's own that drives in a circle: the same program beside KBot alone, on ROS 1 and on ROS 2.

In one terminal:  kbot sim kbot
In another:       python examples/own_node.py _speed:=0.3
"""

import sys

import kbot
from kbot.messages import Odometry, Twist, Vector3


def main() -> None:
    node = kbot.Node("circle")
    speed = node.param("speed", 0.2)

    def hear(odometry: Odometry) -> None:
        place = odometry.pose.pose.position
        print(f"\r{node.now:8.2f} s   x {place.x:6.3f} m   y {place.y:6.3f} m", end="", flush=True)

    node.subscribe("odom", Odometry, hear)
    node.every(0.1, lambda: node.publish("cmd_vel", Twist(Vector3(speed), Vector3(0.0, 0.0, 0.5))))
    node.spin()


try:
    main()
except kbot.KbotError as error:  # no KBot runs, or several do, or it has gone
    print(f"error: {error}", file=sys.stderr)
    sys.exit(2)
