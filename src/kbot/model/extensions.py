"""Finds extensions in a robot description: plugins of Gazebo and hardware of ros2_control."""

from __future__ import annotations

from collections.abc import Iterator
from math import isfinite

from kbot.model.robot import RobotModel
from kbot.text import Element
from kbot.text.numbers import to_float


def extensions(robot: RobotModel, tag: str) -> Iterator[Element]:
    """The `<gazebo>`, `<ros2_control>` or `<transmission>` elements: those with this tag."""
    return (extension for extension in robot.extensions if extension.tag == tag)


def gazebo_plugins(robot: RobotModel) -> Iterator[Element]:
    """The `<plugin>` elements of `<gazebo>` elements in order, without those of sensors and visuals."""
    for extension in extensions(robot, "gazebo"):
        yield from extension.elements("plugin")


def hardware_joints(robot: RobotModel) -> Iterator[Element]:
    """The `<joint>` elements of `<ros2_control>` elements."""
    for extension in extensions(robot, "ros2_control"):
        yield from extension.elements("joint")


def joints_with_motors(robot: RobotModel) -> set[str]:
    """The names of the joints with a motor: those in a `<ros2_control>` or `<transmission>` of ROS 1."""
    joints = [*hardware_joints(robot)]
    for transmission in extensions(robot, "transmission"):
        joints += transmission.elements("joint")
    return {joint.attributes.get("name", "") for joint in joints}


def initial_values(robot: RobotModel) -> Iterator[tuple[str, Element]]:
    """The names of joints, each with the element of its initial position."""
    for joint in hardware_joints(robot):
        for state in joint.elements("state_interface"):
            for parameter in state.elements("param"):
                named = state.attributes.get("name"), parameter.attributes.get("name")
                if named == ("position", "initial_value"):
                    yield joint.attributes.get("name", ""), parameter


def initial_positions(robot: RobotModel) -> dict[str, float]:
    """Initial positions by joint, in rad or m. A value that is not a number is ignored."""
    free = {joint.name for joint in robot.movable_joints if joint.mimic is None}
    found: dict[str, float] = {}
    for joint, element in initial_values(robot):
        try:
            value = to_float(element.text)
        except ValueError:
            continue
        if joint in free and isfinite(value):
            found[joint] = value
    return found
