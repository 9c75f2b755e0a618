"""A user's program: drives the distance `distance` by odometry, then prints what it knows as JSON."""

import json
import sys

import kbot
from kbot.messages import Odometry, Twist, Vector3

node = kbot.Node("driver")
distance = node.param("distance", 0.2)


def on_odometry(odometry: Odometry) -> None:
    x = odometry.pose.pose.position.x
    if x >= distance:
        node.publish("go", Twist())
        sys.stdout.write(
            json.dumps(
                {
                    "name": node.name,
                    "distance": distance,
                    "x": x,
                    "now": node.now,
                    "ticks": len(ticks),
                    "sim_time": node.param("/use_sim_time", False),
                    "rest": node.arguments,
                }
            )
        )
        node.close()


ticks = []
node.subscribe("odom", Odometry, on_odometry)
node.every(0.1, lambda: ticks.append(node.now))
node.every(0.1, lambda: node.publish("go", Twist(Vector3(0.3))))
node.spin(60)
