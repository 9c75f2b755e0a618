"""Finds the plugins of Gazebo that command joints."""

from __future__ import annotations

from kbot.kinematics.drive.declared import words_of
from kbot.sim.joint_control.kinds import Input, Interface
from kbot.text import Element


def commanded_by(plugin: Element) -> tuple[Input, Interface, str] | None:
    """What a plugin hears and commands, and the end of its topic where none is given; None for one that
    commands no joint."""
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
