"""Where joints start, as ros2_control and Gazebo's plugins say it."""

from __future__ import annotations

from collections.abc import Iterator
from math import isfinite

from kbot.model import Robot
from kbot.model.hardware import initial_values
from kbot.sim.joint_control.plugins import commanded_by, plugins
from kbot.text import Element
from kbot.text.numbers import to_float
from kbot.world.findings import Findings


def joint_starts(robot: Robot, free: set[str], findings: Findings) -> Iterator[tuple[str, float]]:
    """Joints that are `free` to be commanded, and their first positions in rad or m; what is no number is
    said at its line."""
    for joint, element in _said(robot):
        if joint not in free:
            continue
        try:
            value = to_float(element.text)
        except ValueError:
            value = float("nan")
        if isfinite(value):
            yield joint, value
        else:
            message = f"the joint '{joint}' starts at no number: '{element.text.strip()}'"
            findings.warning("W130", message, element.origin, "it starts at 0")


def _said(robot: Robot) -> Iterator[tuple[str, Element]]:
    """The names of joints, and what says where each starts."""
    yield from initial_values(robot)
    for plugin in plugins(robot):
        first = plugin.find("initial_position")
        said = plugin.find("joint_name")
        if commanded_by(plugin) is not None and first is not None and said is not None:
            yield said.text.strip(), first
