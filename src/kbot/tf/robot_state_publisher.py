"""robot_state_publisher: publishes the transforms of all links from joint states."""

from __future__ import annotations

from math import isfinite

from kbot.kinematics.frames import JointPose, mimics
from kbot.messages import types as msg
from kbot.messages.bus import Bus
from kbot.messages.clock import Clock
from kbot.model import Joint, RobotModel
from kbot.text import KbotError
from kbot.tf.static_transforms import say_static

_PERIOD = 20_000_000
"""Nanoseconds between two messages on /tf: 50 Hz, the node's default."""


class RobotStatePublisher:
    """Hears `joint_states`; says `/tf` for joints that move, at most `frequency` (Hz) times a second of
    the messages' own time, `/tf_static` once for fixed ones, and `robot_description`.

    `frame_prefix` is the ROS node's parameter (tf_prefix in ROS 1). A joint that is not in a message keeps
    its last position; a mimic joint follows its leader.
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
        self._moving = [_Said(joint, frame_prefix) for joint in robot.movable_joints]
        self._follow = mimics(robot)
        self._names = frozenset(joint.name for joint in robot.movable_joints)
        self._positions: dict[str, float] = {}
        self._last: int | None = None
        self._tf = bus.advertise("/tf", msg.TFMessage)
        if description:
            topic = bus.advertise(f"{namespace}/robot_description", msg.String, latched=True)
            topic.publish(msg.String(description))
        self._subscription = bus.subscribe(f"{namespace}/joint_states", msg.JointState, self.hear)
        fixed = [_Said(joint, frame_prefix) for joint in robot.joints.values() if not joint.is_movable]
        say_static(bus, self._message(fixed, clock.stamp))

    def close(self) -> None:
        """Hear no more."""
        self._subscription.close()

    def hear(self, message: msg.JointState) -> None:
        """Take joint positions and say the transforms they make; names it does not know are left out.

        Raises:
            KbotError: a position that is not finite.
        """
        for name, position in zip(message.name, message.position, strict=False):
            if name in self._names:
                if not isfinite(position):
                    raise KbotError(f"the position of joint '{name}' is not finite")
                self._positions[name] = position
        stamp = message.header.stamp
        now = stamp.nanoseconds
        came_back = self._last is not None and now < self._last
        due = self._last is None or now - self._last >= _PERIOD
        if not (due or came_back):
            return
        if self._last is not None and now > self._last:
            self._tf.rate = 1e9 / (now - self._last)
        self._last = now
        if self._tf.has_subscribers:
            self._tf.publish(self._message(self._moving, stamp))

    def _message(self, joints: list[_Said], stamp: msg.Time) -> msg.TFMessage:
        return msg.TFMessage(tuple(joint.message(stamp, self._position(joint.name)) for joint in joints))

    def _position(self, joint: str) -> float:
        """Where a joint is; it stands at 0 as long as nobody told."""
        if joint not in self._positions and joint in self._follow:
            follow = self._follow[joint]
            return follow.multiplier * self._positions.get(follow.leader, 0.0) + follow.offset
        return self._positions.get(joint, 0.0)


class _Said:
    """A joint as it is said."""

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
