"""A user's program: drives until the odometry says so far, and prints what it came to know as JSON."""

import json
import sys

import kbot
from kbot.messages import Odometry, Twist, Vector3

node = kbot.Node("driver")
wanted = node.param("distance", 0.2)
heard = []


def hear(odometry: Odometry) -> None:
    heard.append(odometry.pose.pose.position.x)
    if heard[-1] >= wanted:
        node.publish("go", Twist())
        sys.stdout.write(
            json.dumps(
                {
                    "name": node.name,
                    "distance": wanted,
                    "x": heard[-1],
                    "now": node.now,
                    "ticks": len(ticks),
                    "sim_time": node.param("/use_sim_time", False),
                    "rest": node.arguments,
                }
            )
        )
        node.close()


ticks = []
node.subscribe("odom", Odometry, hear)
node.every(0.1, lambda: ticks.append(node.now))
node.every(0.1, lambda: node.publish("go", Twist(Vector3(0.3))))
node.spin(60)
