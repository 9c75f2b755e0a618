"""robot_state_publisher: publishes the transforms of all links from joint states."""

from __future__ import annotations

from math import isfinite

from kbot.kinematics.frames import JointPose, mimics
from kbot.messages import types as msg
from kbot.messages.bus import Bus
from kbot.messages.clock import Clock
from kbot.model import Joint, RobotModel
from kbot.text import KbotError
from kbot.tf.static_transforms import add_static_transforms

_PERIOD = 20_000_000
"""Nanoseconds between two messages on /tf: 50 Hz, the node's default."""


class RobotStatePublisher:
    """Subscribes to `joint_states`. Publishes `/tf`, `/tf_static` and `robot_description`.

    It publishes movable joints on `/tf`, at most at 50 Hz in the time of the messages' stamps. It publishes
    fixed joints once, on `/tf_static`. A joint that is not in a message keeps its position. A mimic joint
    follows its leader. `frame_prefix` is the ROS node's parameter (tf_prefix in ROS 1).
    """

    def __init__(
        self,
        robot: RobotModel,
        bus: Bus,
        clock: Clock,
        *,
        description: str = "",
        frame_prefix: str = "",
        namespace: str = "",
    ) -> None:
        self._movable = [_JointTransform(joint, frame_prefix) for joint in robot.movable_joints]
        self._mimics = mimics(robot)
        self._names = frozenset(joint.name for joint in robot.movable_joints)
        self._positions: dict[str, float] = {}
        self._last: int | None = None
        self._tf = bus.advertise("/tf", msg.TFMessage)
        if description:
            topic = bus.advertise(f"{namespace}/robot_description", msg.String, latched=True)
            topic.publish(msg.String(description))
        self._subscription = bus.subscribe(f"{namespace}/joint_states", msg.JointState, self._on_joint_states)
        joints = robot.joints.values()
        fixed = [_JointTransform(joint, frame_prefix) for joint in joints if not joint.is_movable]
        add_static_transforms(bus, self._message(fixed, clock.stamp))

    def close(self) -> None:
        """Stop publishing."""
        self._subscription.close()

    def _on_joint_states(self, message: msg.JointState) -> None:
        """Store the positions and publish `/tf` if it is due. Unknown joints are ignored.

        Raises:
            KbotError: a position is not finite.
        """
        for name, position in zip(message.name, message.position, strict=False):
            if name in self._names:
                if not isfinite(position):
                    raise KbotError(f"the position of joint '{name}' is not finite")
                self._positions[name] = position
        stamp = message.header.stamp
        now = stamp.nanoseconds
        is_earlier = self._last is not None and now < self._last  # time was reset
        is_due = self._last is None or now - self._last >= _PERIOD
        if not (is_due or is_earlier):
            return
        if self._last is not None and now > self._last:
            self._tf.rate = 1e9 / (now - self._last)
        self._last = now
        if self._tf.has_subscribers:
            self._tf.publish_plain(self._message(self._movable, stamp))

    def _message(self, joints: list[_JointTransform], stamp: msg.Time) -> msg.TFMessage:
        return msg.TFMessage(tuple(joint.message(stamp, self._position(joint.name)) for joint in joints))

    def _position(self, joint: str) -> float:
        """A joint's last position, or that of its leader; 0 before the first message."""
        if joint not in self._positions and joint in self._mimics:
            mimic = self._mimics[joint]
            return mimic.multiplier * self._positions.get(mimic.leader, 0.0) + mimic.offset
        return self._positions.get(joint, 0.0)


class _JointTransform:
    """Computes the transform message of a joint."""

    def __init__(self, joint: Joint, prefix: str) -> None:
        self.name = joint.name
        self._parent, self._child = prefix + joint.parent, prefix + joint.child
        self._pose = JointPose(joint)

    def message(self, stamp: msg.Time, position: float) -> msg.TransformStamped:
        translation, rotation = self._pose.at(position)
        return msg.TransformStamped(
            msg.Header(stamp, self._parent),
            self._child,
            msg.Transform(msg.Vector3(*translation), msg.Quaternion(*rotation)),
        )
