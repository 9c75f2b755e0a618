"""robot_state_publisher: joint states in, the transforms of all links out."""

from __future__ import annotations

from kbot.kinematics.frames import FrameTree
from kbot.kinematics.transform import Transform
from kbot.messages import types as msg
from kbot.messages.bus import Bus
from kbot.messages.clock import Clock
from kbot.model import Joint, Robot
from kbot.nodes.static_transform_publisher import say_static

FREQUENCY = 50.0


class RobotStatePublisher:
    """Hears `joint_states`; says `/tf` for joints that move, at most `frequency` (Hz) times a second of
    the messages' own time, `/tf_static` once for fixed ones, and `robot_description`.

    Parameters are those of the ROS node: `publish_frequency`, `use_tf_static`, `frame_prefix` (called
    tf_prefix before), `ignore_timestamp`. A joint that is not in a message keeps its last position; a
    mimic joint follows its leader.
    """

    def __init__(
        self,
        robot: Robot,
        bus: Bus,
        clock: Clock,
        *,
        description: str = "",
        frequency: float = FREQUENCY,
        use_tf_static: bool = True,
        ignore_timestamp: bool = False,
        frame_prefix: str = "",
        namespace: str = "",
    ) -> None:
        self._robot = robot
        self._tree = FrameTree(robot)
        self._clock = clock
        self._period = round(1e9 / frequency) if frequency > 0.0 else 0
        self._use_tf_static = use_tf_static
        self._ignore_timestamp = ignore_timestamp
        self._prefix = frame_prefix
        self._fixed = [joint for joint in robot.joints.values() if not joint.is_movable]
        self._moving = list(robot.movable_joints)
        self._names = {joint.name for joint in self._moving}
        self._positions: dict[str, float] = {}
        self._last: int | None = None
        self._tf = bus.advertise("/tf", msg.TFMessage)
        if description:
            topic = bus.advertise(f"{namespace}/robot_description", msg.String, latched=True)
            topic.publish(msg.String(description))
        self._subscription = bus.subscribe(f"{namespace}/joint_states", msg.JointState, self.hear)
        if use_tf_static:
            say_static(bus, self._message(self._fixed, clock.stamp))

    def close(self) -> None:
        """Hear no more."""
        self._subscription.close()

    def hear(self, message: msg.JointState) -> None:
        """Take joint positions and say the transforms they make; names it does not know are left out."""
        for name, position in zip(message.name, message.position, strict=False):
            if name in self._names:
                self._positions[name] = position
        stamp = message.header.stamp
        now = stamp.nanoseconds
        came_back = self._last is not None and now < self._last
        due = self._last is None or now - self._last >= self._period
        if not (due or came_back or self._ignore_timestamp):
            return
        self._last = now
        joints = self._moving if self._use_tf_static else self._moving + self._fixed
        self._tf.publish(self._message(joints, stamp))

    def _message(self, joints: list[Joint], stamp: msg.Time) -> msg.TFMessage:
        return msg.TFMessage(
            tuple(
                transform_message(
                    self._tree.pose(joint.child, joint.parent, self._positions)
                    if joint.has_position
                    else Transform.from_xyz_rpy(joint.pose.xyz, joint.pose.rpy),
                    msg.Header(stamp, self._prefix + joint.parent),
                    self._prefix + joint.child,
                )
                for joint in joints
            )
        )


def transform_message(transform: Transform, header: msg.Header, child: str) -> msg.TransformStamped:
    """`header.frame_id`_from_`child` as a message."""
    x, y, z = transform.translation.tolist()
    return msg.TransformStamped(
        header,
        child,
        msg.Transform(msg.Vector3(x, y, z), msg.Quaternion(*transform.quaternion_xyzw)),
    )
