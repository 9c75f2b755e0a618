"""What a recording tells of its robot: where it stands, how its joints are, how it moves."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from kbot.kinematics.frames import FrameTree, unit_axis
from kbot.kinematics.transform import Transform
from kbot.messages import JointState, Odometry, TFMessage
from kbot.model import JointType, Robot
from kbot.workbench.scene.foreign_frames import plain, read_transform


class Told:
    """Hears messages one after the other, and keeps what holds since the last of each."""

    def __init__(self, robot: Robot) -> None:
        self._robot = robot
        self.tree = FrameTree(robot)
        self.movable = {joint.name: joint for joint in robot.movable_joints}
        self._edges: dict[str, tuple[str, Transform]] = {}
        """`parent_from_child`, by child."""
        self._positions: dict[str, float] = {}
        self.odometry = (0.0, 0.0, 0.0)
        """x, y, yaw in m and rad."""
        self.twist = (0.0, 0.0)
        """m/s forward and rad/s turning."""

    def forget(self) -> None:
        """Start anew; odometry holds until there is another."""
        self._edges.clear()
        self._positions.clear()

    def hear(self, message: Any) -> None:  # noqa: ANN401 - whatever a topic carries
        """Take in a message of tf, joint states or odometry; others are passed over."""
        if isinstance(message, TFMessage):
            for stamped in message.transforms:
                transform = read_transform(stamped)
                if transform is not None:
                    self._edges[plain(stamped.child_frame_id)] = plain(stamped.header.frame_id), transform
        elif isinstance(message, JointState):
            for name, position in zip(message.name, message.position, strict=False):
                if name in self.movable and math.isfinite(position):
                    self._positions[name] = float(position)
        elif isinstance(message, Odometry):
            self._hear_odometry(message)

    def _hear_odometry(self, message: Odometry) -> None:
        pose, speed = message.pose.pose, message.twist.twist
        numbers = (pose.position.x, pose.position.y, pose.orientation.yaw, speed.linear.x, speed.angular.z)
        if all(map(math.isfinite, numbers)):
            self.odometry, self.twist = numbers[:3], numbers[3:]

    def positions(self) -> dict[str, float]:
        """Joints as they are told, or as tf has it where they are not; rad and m."""
        found = dict(self._positions)
        for name, joint in self.movable.items():
            parent, moved = self._edges.get(joint.child, ("", None))
            if name in found or moved is None or parent != joint.parent or joint.mimic is not None:
                continue
            motion = self.tree.pose(joint.child, joint.parent, {}).inverse() @ moved
            axis = unit_axis(joint)
            if joint.type is JointType.PRISMATIC:
                found[name] = float(motion.translation @ axis)
            else:
                *turn, w = motion.quaternion_xyzw
                found[name] = 2.0 * math.atan2(float(np.dot(turn, axis)), w)
        return found

    def top_from(self, frame: str) -> tuple[str, Transform]:
        """The topmost frame that tf tells of, and where a frame is in it."""
        pose, seen = Transform.identity(), {frame}
        while frame in self._edges:
            frame, parent_from_child = self._edges[frame]
            pose = parent_from_child @ pose
            if frame in seen:
                return frame, Transform.identity()
            seen.add(frame)
        return frame, pose
