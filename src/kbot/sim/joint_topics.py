"""The topics on which a robot's joint controllers hear their commands."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from kbot.messages.bus import Bus, Subscription
from kbot.messages.control import Float64, Float64MultiArray, JointTrajectory
from kbot.sim.joint_control.control import JointController
from kbot.sim.joint_control.kinds import Input
from kbot.sim.joint_control.trajectory_goal import require_joints
from kbot.sim.robot import SimulatedRobot
from kbot.text import KbotError

_MESSAGES: Mapping[Input, type] = {
    Input.NUMBER: Float64,
    Input.ARRAY: Float64MultiArray,
    Input.TRAJECTORY: JointTrajectory,
}


def hear(bus: Bus, robot: SimulatedRobot, controller: JointController) -> Subscription:
    """Let a controller's commands reach the joints while it runs."""

    def take(message: Any) -> None:
        controller.require_active()
        if controller.input is Input.NUMBER:
            robot.command_joints({controller.joints[0]: message.data}, controller.interface)
        elif controller.input is Input.ARRAY:
            _array(robot, controller, message)
        else:
            _trajectory(robot, controller, message)

    return bus.subscribe(robot.naming.topic(controller.topic), _MESSAGES[controller.input], take)


def _array(robot: SimulatedRobot, controller: JointController, message: Float64MultiArray) -> None:
    if len(message.data) != len(controller.joints):
        raise KbotError(
            f"{controller.name} commands {len(controller.joints)} joints and got {len(message.data)} numbers"
        )
    robot.command_joints(dict(zip(controller.joints, message.data, strict=True)), controller.interface)


def _trajectory(robot: SimulatedRobot, controller: JointController, message: JointTrajectory) -> None:
    require_joints(message.joint_names, controller.joints, allows_partial=controller.allows_partial)
    points = [
        (point.time_from_start.seconds, point.positions, point.velocities, point.accelerations)
        for point in message.points
    ]
    robot.follow_trajectory(message.joint_names, points)
