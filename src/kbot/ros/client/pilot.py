"""NodePilot: a navigation controller that drives a robot through a node, simulated or real."""

from __future__ import annotations

import math
import sys

import numpy as np
from numpy.typing import NDArray

from kbot.brief import Brief
from kbot.kinematics.planar_pose import PlanarPose, PlanarTwist
from kbot.kinematics.transform import Transform
from kbot.learn.policies.speed_finding import speed_finding
from kbot.messages import Odometry, Twist
from kbot.messages.navigation import PoseStamped
from kbot.messages.sensing import LaserScan
from kbot.model.load import load_robot_text
from kbot.navigation.controller import (
    STILL,
    Controller,
    Observation,
    require_rate,
    required_rate,
    top_speeds,
)
from kbot.navigation.lidar_view import LidarView
from kbot.navigation.path import from_pose_stamped
from kbot.ros.client.node import Node
from kbot.sensors.lidar import scan_points
from kbot.sim.drive.drive_controller import described_top_speeds

HERE = PlanarPose()
RATE = 20.0
"""Hz. Updates of a controller that requires no rate, and the fewest of others."""


class NodePilot(Brief):
    """Subscribes to `odom` and `scan`, and publishes the controller's commands on `cmd_vel`.

    It accepts the same controllers as `Pilot`. The pose that the controller gets is that of the odometry. If
    no odometry arrives any more, the robot is stopped. If the robot of the parameter `robot_description` is
    slower than the controller's policy, W308 is printed.
    """

    def __init__(
        self,
        node: Node,
        controller: Controller,
        rate: float | None = None,
        base_from_lidar: PlanarPose = HERE,
        silence: float = 0.5,
    ) -> None:
        """Start to drive.

        Args:
            node: where `odom`, `scan` and `cmd_vel` are resolved.
            controller: what decides on the commands.
            rate: updates of the controller in Hz of the node's time; by default 20, or the next multiple of
                the rate that the controller requires, as the controller of a policy does.
            base_from_lidar: the lidar's pose on the robot, seen from above.
            silence: seconds without odometry after which the robot is stopped.

        Raises:
            KbotError: the node already uses one of these topics in another way, or the controller must be
                updated more often than `rate`.
        """
        _report_speeds(node, controller)
        self._node, self._controller, self._silence = node, controller, silence
        x, y, yaw = base_from_lidar.x, base_from_lidar.y, base_from_lidar.yaw
        self._base_from_lidar = Transform.from_xyz_rpy((x, y, 0.0), (0.0, 0.0, yaw)).matrix
        self._odometry: Odometry | None = None
        self._points: NDArray[np.float64] | None = None
        self._view: LidarView | None = None
        self._odometry_at = self._scan_at = -math.inf
        self._subscriptions = [
            node.subscribe("odom", Odometry, self._on_odometry),
            node.subscribe("scan", LaserScan, self._on_scan),
        ]
        self._commands = node.advertise("cmd_vel", Twist)
        required = required_rate(controller)
        default = required * math.ceil(RATE / required) if required else RATE
        self._timer = node.every(1.0 / require_rate(controller, default if rate is None else rate), self.tick)

    def tick(self) -> None:
        """Update the controller once and publish its command."""
        odometry, now = self._odometry, self._node.now
        if odometry is None:
            return
        wanted = STILL
        if now - self._odometry_at <= self._silence:
            pose = from_pose_stamped(PoseStamped(odometry.header, odometry.pose.pose))
            moved = odometry.twist.twist
            motion = PlanarTwist(moved.linear.x, moved.linear.y, moved.angular.z)
            wanted = self._controller.update(
                Observation(now, pose, motion, self._points, now - self._scan_at, view=self._view)
            )
        self._commands.publish(wanted)

    def close(self) -> None:
        """Stop the robot and publish no more commands."""
        self._timer.cancel()
        for subscription in self._subscriptions:
            subscription.close()
        self._commands.publish(STILL)

    def _on_odometry(self, message: Odometry) -> None:
        self._odometry, self._odometry_at = message, self._node.now

    def _on_scan(self, message: LaserScan) -> None:
        pose = self._base_from_lidar
        self._points, self._scan_at = scan_points(message, pose), self._node.now
        self._view = LidarView.of_beams(message.angle_min, message.angle_max, message.range_max, pose)


def _report_speeds(node: Node, controller: Controller) -> None:
    """Print W308 if the described robot is slower than the controller's policy."""
    commanded = top_speeds(controller)
    if commanded is None:  # only the controllers of policies state them
        return
    description = node.param("robot_description", "")
    robot = load_robot_text(description, "robot_description").robot if description else None
    if robot is None:
        return
    finding = speed_finding(commanded, robot.name, described_top_speeds(robot))
    if finding is not None:
        sys.stderr.write(f"{finding}\n")
