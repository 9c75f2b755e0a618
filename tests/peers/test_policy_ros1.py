"""A policy drives a robot through Debian's ROS 1 master."""

import sys
from collections.abc import Iterator
from pathlib import Path

import pytest

from .conftest import Ros, stop, wait_until
from .test_bridge_ros1 import answers, message_on, output_of

DRIVER = """
import sys, kbot
from kbot.learn import Policy, PolicyController
from kbot.ros.client.pilot import NodePilot

with kbot.Node("driver", ()) as node:
    controller = PolicyController(Policy.read(sys.argv[1]), kbot.PlanarPose(0.6, 0.3))
    pilot = NodePilot(node, controller)
    while not controller.is_done:
        node.spin(0.1)
    pilot.close()
    node.spin(0.5)
    print(controller.status)
"""


@pytest.fixture
def robot(ros: Ros) -> Iterator[Ros]:
    """A robot with a lidar in real time, at Debian's master."""
    core = ros.start("roscore", "-p", ros.environment["ROS_MASTER_URI"].rpartition(":")[2])
    wait_until(lambda: answers(ros, "rosparam", "list"), "master")
    words = ("sim", "kbot", "lidar:=true", "--world", "rooms", "--headless", "--ros1")
    running = ros.start(sys.executable, "-m", "kbot", *words)
    try:
        wait_until(lambda: "/scan" in output_of(ros, "rostopic", "list"), "topics")
        yield ros
    finally:
        stop(running)
        stop(core)


def test_a_policy_drives_by_odometry_and_scans_of_ros(robot: Ros, straight_policy: Path) -> None:
    printed = robot.run(sys.executable, "-c", DRIVER, str(straight_policy), timeout=120)
    assert printed.strip().splitlines()[-1] == "reached"
    message = message_on(robot, "/odom")
    position = message["pose"]["pose"]["position"]
    assert (position["x"] - 0.6) ** 2 + (position["y"] - 0.3) ** 2 < 0.2**2
