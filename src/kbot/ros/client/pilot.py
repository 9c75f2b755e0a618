"""NodePilot: a navigation controller that drives a robot through a node, simulated or real."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from kbot.kinematics.planar_pose import PlanarPose, PlanarTwist
from kbot.kinematics.transform import Transform
from kbot.messages import Odometry, Twist
from kbot.messages.navigation import PoseStamped
from kbot.messages.sensing import LaserScan
from kbot.navigation.controller import STILL, Controller, Observation
from kbot.navigation.path import from_pose_stamped
from kbot.ros.client.node import Node
from kbot.sensors.lidar import scan_points

HERE = PlanarPose()


class NodePilot:
    """Subscribes to `odom` and `scan`, and publishes the controller's commands on `cmd_vel`.

    It accepts the same controllers as `Pilot`. The pose that the controller gets is that of the odometry. If
    no odometry arrives any more, the robot is stopped.
    """

    def __init__(
        self,
        node: Node,
        controller: Controller,
        rate: float = 20.0,
        base_from_lidar: PlanarPose = HERE,
        silence: float = 0.5,
    ) -> None:
        """Start to drive.

        Args:
            node: where `odom`, `scan` and `cmd_vel` are resolved.
            controller: what decides on the commands.
            rate: updates of the controller in Hz of the node's time.
            base_from_lidar: the lidar's pose on the robot, seen from above.
            silence: seconds without odometry after which the robot is stopped.

        Raises:
            KbotError: the node already uses one of these topics in another way.
        """
        self._node, self._controller, self._silence = node, controller, silence
        x, y, yaw = base_from_lidar.x, base_from_lidar.y, base_from_lidar.yaw
        self._base_from_lidar = Transform.from_xyz_rpy((x, y, 0.0), (0.0, 0.0, yaw)).matrix
        self._odometry: Odometry | None = None
        self._points: NDArray[np.float64] | None = None
        self._odometry_at = self._scan_at = -math.inf
        self._subscriptions = [
            node.subscribe("odom", Odometry, self._on_odometry),
            node.subscribe("scan", LaserScan, self._on_scan),
        ]
        self._commands = node.advertise("cmd_vel", Twist)
        self._timer = node.every(1.0 / rate, self.tick)

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
                Observation(now, pose, motion, self._points, now - self._scan_at)
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
        self._points, self._scan_at = scan_points(message, self._base_from_lidar), self._node.now
