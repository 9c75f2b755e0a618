"""The joints that a description's own plugins and controllers say they drive."""

from __future__ import annotations

from collections.abc import Iterable, Iterator

from kbot.model import Joint, Robot
from kbot.text import Element

_DRIVES = ("diff_drive", "diffdrive", "skid_steer", "skidsteer")
LEFT_TAGS = ("leftJoint", "left_joint", "leftFrontJoint", "leftRearJoint")
RIGHT_TAGS = ("rightJoint", "right_joint", "rightFrontJoint", "rightRearJoint")

_TRACTION = ("left_joint", "right_joint", "rear_left_joint", "rear_right_joint", "actuatedWheel")


def drive_plugins(robot: Robot) -> Iterator[Element]:
    """The `<plugin>` elements of differential and skid-steer drives, of Gazebo Classic and gz."""
    for extension in robot.extensions:
        if extension.tag == "gazebo":
            for plugin in extension.elements("plugin"):
                names = (plugin.attributes.get("filename", "") + plugin.attributes.get("name", "")).lower()
                if any(word in names for word in _DRIVES):
                    yield plugin


def is_drive_file(plugin: Element) -> bool:
    """Whether a plugin's file, and not its name alone, is that of a differential or skid-steer drive."""
    file = plugin.attributes.get("filename", "").lower().replace("-", "_")
    return any(word in file for word in _DRIVES)


def plugin_joints(plugin: Element) -> tuple[list[str], list[str]]:
    """The joints a drive plugin names as left and right, as written."""
    left = [name for e in plugin.elements() if e.tag in LEFT_TAGS and (name := e.text.strip())]
    right = [name for e in plugin.elements() if e.tag in RIGHT_TAGS and (name := e.text.strip())]
    return left, right


def plugin_sides(robot: Robot) -> tuple[list[str], list[str]]:
    """The joints that the drive plugins name as left and as right; of several plugins the first decides."""
    left, right = list[str](), list[str]()
    for plugin in drive_plugins(robot):
        known = {*left, *right}
        for side, names in zip((left, right), plugin_joints(plugin), strict=True):
            side += [name for name in names if name not in known]
    return left, right


def plugin_driven_joints(robot: Robot) -> list[Joint]:
    """The movable joints that the drive plugins name."""
    left, right = plugin_sides(robot)
    return _movable(robot, [*left, *right])


def steering_plugin_joints(robot: Robot) -> list[Joint]:
    """The movable joints that gz's AckermannSteering, or a plugin of a tricycle, drives."""
    elements = (element for plugin in steering_plugins(robot) for element in plugin.elements())
    return _movable(robot, [e.text.strip() for e in elements if e.tag in _TRACTION])


def steering_plugins(robot: Robot) -> Iterator[Element]:
    """The `<plugin>` elements of bases that steer: gz's AckermannSteering, Classic's cars and tricycles."""
    for extension in robot.extensions:
        if extension.tag == "gazebo":
            for plugin in extension.elements("plugin"):
                names = (plugin.attributes.get("filename", "") + plugin.attributes.get("name", "")).lower()
                if "ackermann" in names or "tricycle" in names:
                    yield plugin


def velocity_joints(robot: Robot) -> list[Joint]:
    """The movable joints that a `<ros2_control>` commands by velocity."""
    names = [
        joint.attributes.get("name", "")
        for extension in robot.extensions
        if extension.tag == "ros2_control"
        for joint in extension.elements("joint")
        if any(c.attributes.get("name") == "velocity" for c in joint.elements("command_interface"))
    ]
    return _movable(robot, names)


def _movable(robot: Robot, names: Iterable[str]) -> list[Joint]:
    joints = (robot.joints.get(name) for name in dict.fromkeys(names))
    return [joint for joint in joints if joint is not None and joint.has_position]
