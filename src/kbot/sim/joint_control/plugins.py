"""Finds the plugins of Gazebo that command joints."""

from __future__ import annotations

from kbot.kinematics.drive.programs import words_of
from kbot.sim.joint_control.kinds import Input, Interface
from kbot.text import Element


def commanded_by(plugin: Element) -> tuple[Input, Interface, str] | None:
    """A plugin's message type, what it commands, and the end of its default topic.

    None for a plugin that does not command joints.
    """
    words = words_of(plugin)
    if "jointposetrajectory" in words:
        return Input.TRAJECTORY, Interface.POSITION, "set_joint_trajectory"
    if "jointtrajectorycontroller" in words:
        return Input.TRAJECTORY, Interface.POSITION, "joint_trajectory"
    if "jointpositioncontroller" in words:
        return Input.NUMBER, Interface.POSITION, "0/cmd_pos"
    if "jointcontroller" in words:
        return Input.NUMBER, Interface.VELOCITY, "cmd_vel"
    return None
