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
    """Hears `odom` and `scan`, asks the controller, and says `cmd_vel`; the same controllers as `Pilot` has.

    The pose it tells is that of the odometry. Once odometry is silent, the robot is told to stand still.
    """

    def __init__(
        self,
        node: Node,
        controller: Controller,
        rate: float = 20.0,
        base_from_lidar: PlanarPose = HERE,
        silence: float = 0.5,
    ) -> None:
        """`base_from_lidar`: where the lidar sits, seen from above; `rate` in Hz and `silence` in s of the
        node's clock.

        Raises:
            KbotError: the node says one of these topics otherwise.
        """
        self._node, self._controller, self._silence = node, controller, silence
        x, y, yaw = base_from_lidar.x, base_from_lidar.y, base_from_lidar.yaw
        self._base_from_lidar = Transform.from_xyz_rpy((x, y, 0.0), (0.0, 0.0, yaw)).matrix
        self._odometry: Odometry | None = None
        self._points: NDArray[np.float64] | None = None
        self._heard_at = self._seen_at = -math.inf
        self._heard = [
            node.subscribe("odom", Odometry, self._hear),
            node.subscribe("scan", LaserScan, self._see),
        ]
        self._commands = node.advertise("cmd_vel", Twist)
        self._timer = node.every(1.0 / rate, self.tick)

    def tick(self) -> None:
        """Ask the controller once and say what it wants."""
        odometry, now = self._odometry, self._node.now
        if odometry is None:
            return
        wanted = STILL
        if now - self._heard_at <= self._silence:
            pose = from_pose_stamped(PoseStamped(odometry.header, odometry.pose.pose))
            moved = odometry.twist.twist
            motion = PlanarTwist(moved.linear.x, moved.linear.y, moved.angular.z)
            wanted = self._controller.update(
                Observation(now, pose, motion, self._points, now - self._seen_at)
            )
        self._commands.publish(wanted)

    def close(self) -> None:
        """Drive no more: the robot is told to stand still."""
        self._timer.cancel()
        for subscription in self._heard:
            subscription.close()
        self._commands.publish(STILL)

    def _hear(self, message: Odometry) -> None:
        self._odometry, self._heard_at = message, self._node.now

    def _see(self, message: LaserScan) -> None:
        self._points, self._seen_at = scan_points(message, self._base_from_lidar), self._node.now
