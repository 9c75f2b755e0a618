"""Which joints a robot's plugin or controller commands as its left and right wheels."""

from __future__ import annotations

from collections.abc import Iterator

from kbot.kinematics.controllers import LEFT_TAGS, RIGHT_TAGS, drive_plugins
from kbot.kinematics.drive import DifferentialDrive, NoDrive, with_sides
from kbot.kinematics.steered_drive import SteeredDrive
from kbot.model import Robot
from kbot.sim.joint_control.controllers_yaml import Parameters, diff_drive_parameters
from kbot.text import Origin
from kbot.text.suggest import did_you_mean
from kbot.world.findings import Findings

_LEFT, _RIGHT = ("left_wheel_names", "left_wheel"), ("right_wheel_names", "right_wheel")
"""Parameters of diff_drive_controller: ROS 2's and ROS 1's."""


def commanded(robot: Robot, drive: DifferentialDrive | NoDrive) -> DifferentialDrive | NoDrive:
    """The drive with the sides that the robot's controller names. A plugin's sides are in it already, and a
    plugin is what drives where the robot has both."""
    found = _controller(robot, drive)
    return with_sides(drive, _names(found, _LEFT), _names(found, _RIGHT)) if found is not None else drive


def check_named_joints(robot: Robot, drive: DifferentialDrive | NoDrive, findings: Findings) -> None:
    """Report the joints that a drive names and the robot does not have, and those it commands wrongly."""
    sides = list(_sides(robot, drive))
    lefts = {name for side, name, _ in sides if side == "left"}
    mistakes = drive.mistakes if isinstance(drive, DifferentialDrive) else {}
    is_reported = False
    for side, name, origin in sides:
        if name not in robot.joints:
            message = f"the drive names the joint '{name}', which the robot does not have"
            findings.warning("W134", message, origin, did_you_mean(name, robot.joints))
        elif side == "right" and name in lefts and isinstance(drive, NoDrive):
            message = (
                f"the drive names the joint '{name}' both as left and as right: the robot does not drive"
            )
            findings.warning("W145", message, origin, "name the joint of each wheel once, on its own side")
        elif name in mistakes and not is_reported:
            findings.warning("W146", mistakes[name], origin, "`kbot rule` explains it: D107, D108 and D109")
            is_reported = True  # the other wheels mostly have the same mistake


def _sides(robot: Robot, drive: DifferentialDrive | NoDrive) -> Iterator[tuple[str, str, Origin]]:
    """Each joint that a plugin or controller names: its side, its name, and where that is written."""
    for plugin in drive_plugins(robot):
        for element in plugin.elements():
            name = element.text.strip()
            if name and element.tag in (*LEFT_TAGS, *RIGHT_TAGS):
                yield "left" if element.tag in LEFT_TAGS else "right", name, element.origin
    found = _controller(robot, drive)
    if found is not None:
        yield from (("left", name, found.place(*_LEFT)) for name in _names(found, _LEFT))
        yield from (("right", name, found.place(*_RIGHT)) for name in _names(found, _RIGHT))


def _controller(robot: Robot, drive: DifferentialDrive | NoDrive) -> Parameters | None:
    """The controller of two sides that drives a robot without a drive plugin."""
    if isinstance(drive, SteeredDrive) or next(drive_plugins(robot), None) is not None:
        return None
    return diff_drive_parameters(
        robot, Findings()
    )  # what is wrong with its file is reported where it is used


def _names(found: Parameters, keys: tuple[str, ...]) -> list[str]:
    named = next((found.values[key] for key in keys if key in found.values), None)
    names = named if isinstance(named, list) else [named]
    return [name for name in names if isinstance(name, str)]
