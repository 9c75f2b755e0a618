"""The topics of a robot: it publishes its state every control period, and receives commands."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from functools import partial
from math import cos, sin
from typing import Any

from kbot.kinematics.spatial import quaternion_product
from kbot.messages import types as msg
from kbot.messages.bus import Bus, Publisher, Subscription
from kbot.messages.clock import NANOSECONDS, Clock
from kbot.messages.control import Float64, Float64MultiArray, JointTrajectory
from kbot.sim.joint_control.control import JointController
from kbot.sim.joint_control.kinds import Input
from kbot.sim.joint_control.trajectory_goal import require_joints
from kbot.sim.recipe import CONTROL_PERIOD
from kbot.sim.robot import SimulatedRobot
from kbot.sim.trajectory_action import TrajectoryAction
from kbot.sim.wheel_odometry import Motion
from kbot.text import KbotError

POSE_VARIANCE = (0.001, 0.001, 0.001, 0.001, 0.001, 0.01)
"""Diagonal over x, y, z and rotations, as diff_drive_controller has it."""

_MESSAGES: Mapping[Input, type] = {
    Input.NUMBER: Float64,
    Input.ARRAY: Float64MultiArray,
    Input.TRAJECTORY: JointTrajectory,
}
"""The message types of the topics of controllers."""


def covariance(diagonal: tuple[float, ...]) -> tuple[float, ...]:
    """6x6, row by row."""
    return tuple(diagonal[row] if row == column else 0.0 for row in range(6) for column in range(6))


class RobotTopics:
    """`odom`, `tf` and `joint_states` out, `cmd_vel` in. Messages without a subscriber are not made."""

    def __init__(
        self,
        bus: Bus,
        clock: Clock,
        robot: SimulatedRobot,
        report: Callable[[str], None],
        *,
        publishes_clock: bool,
    ) -> None:
        """`report` receives sentences for the user; `publishes_clock`: whether `/clock` is one of them."""
        self._robot = robot
        naming = robot.naming
        self._frame_prefix = naming.frame_prefix
        self._covariance = covariance(POSE_VARIANCE)
        advertise = partial(bus.advertise, rate=1.0 / CONTROL_PERIOD)
        joints = partial(joint_state, robot)
        self._outputs: list[tuple[Publisher[Any], Callable[[msg.Time], object]]] = [
            (advertise(naming.topic("joint_states"), msg.JointState), joints),
        ]
        if publishes_clock:
            self._outputs.insert(0, (advertise("/clock", msg.ClockMessage), msg.ClockMessage))
        self._outputs += [
            (advertise(naming.topic(topic), msg.JointState), joints)
            for topic in robot.joints.control.state_topics
            if naming.topic(topic) != naming.topic("joint_states")
        ]
        self._clock = clock
        self._commands: list[Subscription | TrajectoryAction] = []
        for controller in robot.joints.control.controllers:
            self._commands.append(_subscribe_controller(bus, robot, controller))
            if controller.constraints is not None:
                self._commands.append(TrajectoryAction(bus, clock, robot, controller, report))
        self._odometry_frame = self._frame_prefix
        if robot.settings is not None:
            self._odometry_frame += robot.settings.odometry_frame
            self._outputs += [
                (
                    advertise(naming.topic(robot.settings.odometry_topic), msg.Odometry),
                    self._odometry,
                ),
                (advertise("/tf", msg.TFMessage), self._transform),
            ]
            self._commands += [
                bus.subscribe(naming.topic(topic), kind, self._drive)
                for topic, kind in robot.settings.command_topics.items()
            ]
            self._outputs += [
                (advertise(naming.topic(topic), msg.Odometry), self._odometry)
                for topic in robot.settings.odometry_topics[1:]
            ]
        self._subscribed = self._outputs
        self._motion: Motion | None = None
        """The odometry of this period, computed for the first message that needs it."""
        base_from_root = robot.body.base_from_root
        x, y, z = base_from_root.translation.tolist()
        self._base_from_root = (x, y, z), base_from_root.quaternion_xyzw

    def close(self) -> None:
        """Receive no more commands and publish nothing more."""
        for commands in self._commands:
            commands.close()
        for publisher, _ in self._outputs:
            publisher.close()

    def _drive(self, message: msg.Twist | msg.TwistStamped) -> None:
        if isinstance(message, msg.TwistStamped):
            self._require_new(message.header.stamp)
            message = message.twist
        self._robot.command(message.linear.x, message.angular.z)

    def _require_new(self, stamp: msg.Time) -> None:
        """Raises KbotError: the command is older than what its controller waits for. One without a stamp, and
        one of another clock that is ahead, are of now, as its namesake has it."""
        settings = self._robot.settings
        age = (self._clock.nanoseconds - stamp.nanoseconds) / NANOSECONDS
        if settings is not None and stamp.nanoseconds and age > settings.watchdog:
            what = f"its stamp is {age:.3f} s old, more than the cmd_vel_timeout of {settings.watchdog:g} s"
            raise KbotError(f"{what}: stamp it with the time of /clock")

    def find_subscribers(self) -> bool:
        """Find the topics with subscribers, whenever these may have changed; whether there are any."""
        self._subscribed = [output for output in self._outputs if output[0].has_subscribers]
        return bool(self._subscribed)

    def publish(self, clock: Clock) -> None:
        """Publish the time and the state of the robot as they are now, on topics with subscribers."""
        stamp = clock.stamp
        self._motion = None
        for publisher, message in self._subscribed:
            publisher.publish(message(stamp))

    def _odometry(self, stamp: msg.Time) -> msg.Odometry:
        motion = self._motion = self._motion or self._robot.odometry
        pose, twist = motion.pose, motion.twist
        return msg.Odometry(
            msg.Header(stamp, self._odometry_frame),
            self._frame_prefix + self._robot.base,
            msg.PoseWithCovariance(
                msg.Pose(msg.Point(pose.x, pose.y, 0.0), msg.Quaternion.about_z(pose.yaw)), self._covariance
            ),
            msg.TwistWithCovariance(
                msg.Twist(msg.Vector3(twist.x, twist.y, 0.0), msg.Vector3(0.0, 0.0, twist.yaw)),
                self._covariance,
            ),
        )

    def _transform(self, stamp: msg.Time) -> msg.TFMessage:
        """odom -> the robot's root, so that every frame keeps one parent."""
        motion = self._motion = self._motion or self._robot.odometry
        pose = motion.pose
        (x, y, z), turn = self._base_from_root
        c, s = cos(pose.yaw), sin(pose.yaw)  # PlanarPose.apply takes ten times as long
        half = pose.yaw / 2.0
        return msg.TFMessage(
            (
                msg.TransformStamped(
                    msg.Header(stamp, self._odometry_frame),
                    self._frame_prefix + self._robot.robot.root,
                    msg.Transform(
                        msg.Vector3(pose.x + c * x - s * y, pose.y + s * x + c * y, z),
                        msg.Quaternion(*quaternion_product((0.0, 0.0, sin(half), cos(half)), turn)),
                    ),
                ),
            )
        )


def joint_state(robot: SimulatedRobot, stamp: msg.Time) -> msg.JointState:
    """Positions (rad or m), speeds and efforts of every joint with a position."""
    positions = robot.body.joint_positions
    return msg.JointState(
        msg.Header(stamp),
        tuple(positions),
        tuple(positions.values()),
        tuple(robot.body.joint_velocities.values()),
        tuple(robot.body.joint_efforts.values()),
    )


def _subscribe_controller(bus: Bus, robot: SimulatedRobot, controller: JointController) -> Subscription:
    """Let the messages of a controller's topic command its joints."""

    def take(message: Any) -> None:  # noqa: ANN401 - of the type that the controller takes
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
            f"{controller.name} commands {len(controller.joints)} joints and got {len(message.data)} numbers"
        )
    robot.command_joints(dict(zip(controller.joints, message.data, strict=True)), controller.interface)


def _follow_trajectory(robot: SimulatedRobot, controller: JointController, message: JointTrajectory) -> None:
    require_joints(message.joint_names, controller.joints, allows_partial=controller.allows_partial)
    points = [
        (point.time_from_start.seconds, point.positions, point.velocities, point.accelerations)
        for point in message.points
    ]
    robot.follow_trajectory(message.joint_names, points)
