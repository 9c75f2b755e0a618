#!/usr/bin/env python3
"""A node that drives 1 m, by odometry, and stops."""

import sys

import kbot
from kbot.messages import Odometry, Twist, Vector3


def main() -> None:
    node = kbot.Node("metre")

    def on_odometry(odometry: Odometry) -> None:
        x = odometry.pose.pose.position.x
        if x < 1.0:
            node.publish("cmd_vel", Twist(Vector3(0.2)))
        else:
            node.publish("cmd_vel", Twist())
            print(f"stopped at x = {x:.2f} m")
            node.close()

    node.subscribe("odom", Odometry, on_odometry)
    node.spin()


try:
    main()
except kbot.KbotError as error:  # no KBot is running, or several are, or it has stopped
    print(f"error: {error}", file=sys.stderr)
    sys.exit(2)
