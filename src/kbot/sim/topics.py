"""The topics of a robot: its state, published every control period, and its commands."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import partial
from math import cos, sin
from typing import Any

from kbot.kinematics.spatial import quaternion_product
from kbot.messages import types as msg
from kbot.messages.bus import Bus, Publisher, Subscription
from kbot.messages.clock import NANOSECONDS, Clock, Timer
from kbot.messages.control import Float64, Float64MultiArray, JointTrajectory
from kbot.sim.drive.odometry_settings import OdometrySettings
from kbot.sim.joint_control.control import JointController
from kbot.sim.joint_control.kinds import Input
from kbot.sim.joint_control.trajectory_goal import require_joints
from kbot.sim.recipe import CONTROL_RATE
from kbot.sim.robot import SimulatedRobot
from kbot.sim.trajectory_action import TrajectoryAction
from kbot.sim.wheel_odometry import Motion
from kbot.text import KbotError

_MESSAGES: Mapping[Input, type] = {
    Input.NUMBER: Float64,
    Input.ARRAY: Float64MultiArray,
    Input.TRAJECTORY: JointTrajectory,
}
"""The message types of the topics of controllers."""

_LEAST = 1e-9
"""The lowest rate in Hz: lower ones, which a clock does not take, publish nothing within 30 years either."""
_Output = tuple[Publisher[Any], Callable[[msg.Time], object]]


@dataclass(slots=True)
class _Timed:
    """Outputs with a rate other than that of control periods, and the timer that publishes them. Without a
    subscriber they have no timer, because every timer interrupts the engine's steps."""

    outputs: list[_Output]
    timer: Timer | None = None

    def stop(self) -> None:
        if self.timer is not None:
            self.timer.cancel()
            self.timer = None


def odometry_frames(robot: SimulatedRobot) -> tuple[str, str, str]:
    """The frame of odometry, the robot's frame in it, and the frame that the transform places.

    The last is the robot's root, so that every frame has one parent, also where the plugin names another link
    of the robot. If the plugin names something else, the transform places that, as the plugin's does.
    """
    root, settings = robot.robot.root, robot.settings
    prefix = robot.naming.frame_prefix
    if settings is None:
        return prefix + "odom", prefix + robot.base, prefix + root
    odometry = settings.odometry
    prefix = prefix if odometry.prefix is None else odometry.prefix
    base = odometry.base_frame or robot.base
    is_link = base.rpartition("/")[2] in robot.robot.links
    return prefix + settings.odometry_frame, prefix + base, prefix + (root if is_link else base)


def covariance(diagonal: tuple[float, ...]) -> tuple[float, ...]:
    """A diagonal 6x6 matrix, row by row."""
    return tuple(diagonal[row] if row == column else 0.0 for row in range(6) for column in range(6))


class RobotTopics:
    """Publishes `odom`, `tf` and `joint_states`, and subscribes to `cmd_vel`.

    Messages are created only for topics with a subscriber.
    """

    def __init__(
        self,
        bus: Bus,
        clock: Clock,
        robot: SimulatedRobot,
        report: Callable[[str], None],
        *,
        publishes_clock: bool,
        timestep: float,
    ) -> None:
        """`report` receives reports to the user. `publishes_clock`: whether this robot publishes `/clock`.
        `timestep` is the simulation's, in s.

        Raises:
            KbotError: a topic exists with another type.
        """
        self._robot, self._bus, self._clock = robot, bus, clock
        self._frames = odometry_frames(robot)
        odometry = robot.settings.odometry if robot.settings is not None else OdometrySettings()
        self._covariances = covariance(odometry.pose), covariance(odometry.twist)
        self._most = 1.0 / timestep
        """The highest rate in Hz: a state is published at most at every time step."""
        self._outputs: list[_Output] = []
        """What is published every control period."""
        self._timed: dict[float, _Timed] = {}
        """What has another rate, by that rate in Hz."""
        self._commands: list[Subscription | TrajectoryAction] = []
        self._ignores_sideways = False
        """Whether a sideways command was reported that this robot cannot follow."""
        self._motion: Motion | None = None
        """The odometry of this period, computed once for all messages."""
        base_from_root = robot.body.base_from_root
        x, y, z = base_from_root.translation.tolist()
        self._base_from_root = (x, y, z), base_from_root.quaternion_xyzw
        try:
            self._open(report, publishes_clock)
        except KbotError:
            self.close()
            raise
        self._subscribed = self._outputs

    def _open(self, report: Callable[[str], None], publishes_clock: bool) -> None:
        """Advertise and subscribe. Raises KbotError: a topic exists with another type."""
        robot, bus, naming = self._robot, self._bus, self._robot.naming
        if publishes_clock:  # first, because the time is published before the state at this time
            self._advertise("/clock", msg.ClockMessage, msg.ClockMessage)
        rates = {naming.topic("joint_states"): CONTROL_RATE}
        rates |= {naming.topic(topic): rate for topic, rate in robot.joints.control.state_topics.items()}
        for topic, rate in rates.items():
            self._advertise(topic, msg.JointState, partial(joint_state, robot), rate)
        for controller in robot.joints.control.controllers:
            self._commands.append(_subscribe_controller(bus, robot, controller))
            if controller.constraints is not None:
                self._commands.append(TrajectoryAction(bus, self._clock, robot, controller, report))
        if robot.settings is None:
            return
        odometry = robot.settings.odometry
        for topic in robot.settings.odometry_topics:
            self._advertise(naming.topic(topic), msg.Odometry, self._odometry, odometry.rate)
        if odometry.has_transform:
            self._advertise(odometry.transform_topic, msg.TFMessage, self._transform, odometry.rate)
        for topic, command in robot.settings.command_topics.items():
            drive = partial(self._drive, naming.topic(topic), report)
            self._commands.append(bus.subscribe(naming.topic(topic), command, drive))

    def _advertise(
        self, topic: str, kind: type, message: Callable[[msg.Time], object], rate: float = CONTROL_RATE
    ) -> None:
        rate = min(max(rate, _LEAST), self._most)
        outputs = self._outputs
        if rate != CONTROL_RATE:
            outputs = self._timed.setdefault(rate, _Timed([])).outputs
        outputs.append((self._bus.advertise(topic, kind, rate=rate), message))

    def close(self) -> None:
        """Unsubscribe from commands and stop publishing."""
        for commands in self._commands:
            commands.close()
        for publisher, _ in self._outputs:
            publisher.close()
        for timed in self._timed.values():
            for publisher, _ in timed.outputs:
                publisher.close()
            timed.stop()

    def _drive(
        self, topic: str, report: Callable[[str], None], message: msg.Twist | msg.TwistStamped
    ) -> None:
        if isinstance(message, msg.TwistStamped):
            self._require_new(message.header.stamp)
            message = message.twist
        lateral = message.linear.y
        if lateral and not self._robot.drives_sideways:
            if not self._ignores_sideways:
                self._ignores_sideways = True
                report(f"{topic}: robot '{self._robot.name}' cannot drive sideways: linear.y is ignored")
            lateral = 0.0
        self._robot.command(message.linear.x, message.angular.z, lateral=lateral)

    def _require_new(self, stamp: msg.Time) -> None:
        """Raises KbotError: the command is older than its controller's timeout.

        As in diff_drive_controller, a command without a stamp counts as new. So does one from a clock that
        is ahead.
        """
        settings = self._robot.settings
        age = (self._clock.nanoseconds - stamp.nanoseconds) / NANOSECONDS
        if settings is not None and stamp.nanoseconds and age > settings.watchdog:
            what = f"the stamp is {age:.3f} s old, more than the cmd_vel_timeout of {settings.watchdog:g} s"
            raise KbotError(f"{what}: stamp the command with the time of /clock")

    def find_subscribers(self, nanoseconds: int) -> bool:
        """Find the topics with subscribers. Returns whether there are any. Messages are published from this
        simulated time on."""
        self._subscribed = [output for output in self._outputs if output[0].has_subscribers]
        for rate, timed in self._timed.items():
            is_subscribed = any(publisher.has_subscribers for publisher, _ in timed.outputs)
            if not is_subscribed:
                timed.stop()
            elif timed.timer is None:
                publish = partial(self._publish_timed, timed)
                timed.timer = self._clock.every(rate, publish, start=nanoseconds)
        return bool(self._subscribed) or any(timed.timer for timed in self._timed.values())

    def publish(self, clock: Clock) -> None:
        """Publish the current time and state of the robot on the topics with subscribers."""
        self._publish(self._subscribed, clock.stamp)

    def _publish_timed(self, timed: _Timed) -> None:
        outputs = [output for output in timed.outputs if output[0].has_subscribers]
        self._publish(outputs, self._clock.stamp)

    def _publish(self, outputs: list[_Output], stamp: msg.Time) -> None:
        self._motion = None
        for publisher, message in outputs:
            publisher.publish_plain(message(stamp))

    def _odometry(self, stamp: msg.Time) -> msg.Odometry:
        motion = self._motion = self._motion or self._robot.odometry
        pose, twist = motion.pose, motion.twist
        (frame, base, _), (pose_covariance, twist_covariance) = self._frames, self._covariances
        return msg.Odometry(
            msg.Header(stamp, frame),
            base,
            msg.PoseWithCovariance(
                msg.Pose(msg.Point(pose.x, pose.y, 0.0), msg.Quaternion.about_z(pose.yaw)), pose_covariance
            ),
            msg.TwistWithCovariance(
                msg.Twist(msg.Vector3(twist.x, twist.y, 0.0), msg.Vector3(0.0, 0.0, twist.yaw)),
                twist_covariance,
            ),
        )

    def _transform(self, stamp: msg.Time) -> msg.TFMessage:
        """The transform from odom to the robot's root link, so that every frame has one parent."""
        motion = self._motion = self._motion or self._robot.odometry
        pose, (frame, _, root) = motion.pose, self._frames
        (x, y, z), turn = self._base_from_root
        c, s = cos(pose.yaw), sin(pose.yaw)  # ten times as fast as PlanarPose.apply
        half = pose.yaw / 2.0
        return msg.TFMessage(
            (
                msg.TransformStamped(
                    msg.Header(stamp, frame),
                    root,
                    msg.Transform(
                        msg.Vector3(pose.x + c * x - s * y, pose.y + s * x + c * y, z),
                        msg.Quaternion(*quaternion_product((0.0, 0.0, sin(half), cos(half)), turn)),
                    ),
                ),
            )
        )


def joint_state(robot: SimulatedRobot, stamp: msg.Time) -> msg.JointState:
    """Positions (rad or m), velocities and efforts of every joint that has a position."""
    positions = robot.body.joint_positions
    return msg.JointState(
        msg.Header(stamp),
        tuple(positions),
        tuple(positions.values()),
        tuple(robot.body.joint_velocities.values()),
        tuple(robot.body.joint_efforts.values()),
    )


def _subscribe_controller(bus: Bus, robot: SimulatedRobot, controller: JointController) -> Subscription:
    """Subscribe to a controller's topic. Its messages command the controller's joints."""

    def take(message: Any) -> None:  # noqa: ANN401 - of the controller's message type
        controller.require_active()
        if controller.input is Input.NUMBER:
            robot.command_joints({controller.joints[0]: message.data}, controller.interface)
        elif controller.input is Input.ARRAY:
            _command_array(robot, controller, message)
        else:
            _follow_trajectory(robot, controller, message)

    return bus.subscribe(robot.naming.topic(controller.topic), _MESSAGES[controller.input], take)


def _command_array(robot: SimulatedRobot, controller: JointController, message: Float64MultiArray) -> None:
    if len(message.data) != len(controller.joints):
        raise KbotError(
            f"{controller.name} needs {len(controller.joints)} numbers, one per joint, but received"
            f" {len(message.data)}"
        )
    robot.command_joints(dict(zip(controller.joints, message.data, strict=True)), controller.interface)


def _follow_trajectory(robot: SimulatedRobot, controller: JointController, message: JointTrajectory) -> None:
    require_joints(message.joint_names, controller.joints, allows_partial=controller.allows_partial)
    points = [
        (point.time_from_start.seconds, point.positions, point.velocities, point.accelerations)
        for point in message.points
    ]
    robot.follow_trajectory(message.joint_names, points)
