"""The topics on which a robot's joint controllers hear their commands."""

from __future__ import annotations

from collections.abc import Mapping

from kbot.messages.bus import Bus, Subscription
from kbot.messages.control import Float64, Float64MultiArray, JointTrajectory
from kbot.sim.joint_control.controllers import JointController
from kbot.sim.joint_control.kinds import Input
from kbot.sim.robot import SimulatedRobot
from kbot.text import KbotError

_MESSAGES: Mapping[Input, type] = {
    Input.NUMBER: Float64,
    Input.ARRAY: Float64MultiArray,
    Input.TRAJECTORY: JointTrajectory,
}


def hear(bus: Bus, robot: SimulatedRobot, controller: JointController) -> Subscription:
    """Let a controller's commands reach the joints."""
    topic, joints = robot.naming.topic(controller.topic), controller.joints
    if not controller.is_active:
        return bus.subscribe(topic, _MESSAGES[controller.input], lambda _: _refuse(controller))
    if controller.input is Input.NUMBER:
        return bus.subscribe(
            topic, Float64, lambda m: robot.command_joints({joints[0]: m.data}, controller.interface)
        )
    if controller.input is Input.ARRAY:
        return bus.subscribe(topic, Float64MultiArray, lambda m: _array(robot, controller, m))
    return bus.subscribe(topic, JointTrajectory, lambda m: _trajectory(robot, controller, m))


def _refuse(controller: JointController) -> None:
    raise KbotError(f"{controller.name} was loaded and not started: it commands nothing")


def _array(robot: SimulatedRobot, controller: JointController, message: Float64MultiArray) -> None:
    if len(message.data) != len(controller.joints):
        raise KbotError(
            f"{controller.name} commands {len(controller.joints)} joints and got {len(message.data)} numbers"
        )
    robot.command_joints(dict(zip(controller.joints, message.data, strict=True)), controller.interface)


def _trajectory(robot: SimulatedRobot, controller: JointController, message: JointTrajectory) -> None:
    strangers = [joint for joint in message.joint_names if joint not in controller.joints]
    if strangers:
        known = ", ".join(controller.joints)
        raise KbotError(f"{controller.name} does not command '{strangers[0]}', only {known}")
    points = [
        (point.time_from_start.seconds, point.positions, point.velocities, point.accelerations)
        for point in message.points
    ]
    robot.follow_trajectory(message.joint_names, points)
