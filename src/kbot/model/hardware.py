"""What the hardware of ros2_control says of a robot's joints."""

from __future__ import annotations

from collections.abc import Iterator
from math import isfinite

from kbot.model.robot import Robot
from kbot.text import Element
from kbot.text.numbers import to_float


def hardware_joints(robot: Robot) -> Iterator[Element]:
    """Each `<joint>` of the hardware."""
    for extension in robot.extensions:
        if extension.tag == "ros2_control":
            yield from extension.elements("joint")


def initial_values(robot: Robot) -> Iterator[tuple[str, Element]]:
    """The names of joints, and what says where each starts."""
    for joint in hardware_joints(robot):
        for state in joint.elements("state_interface"):
            for parameter in state.elements("param"):
                named = state.attributes.get("name"), parameter.attributes.get("name")
                if named == ("position", "initial_value"):
                    yield joint.attributes.get("name", ""), parameter


def initial_positions(robot: Robot) -> dict[str, float]:
    """Where joints stand at first, in rad or m by name; what is no number is left out."""
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
