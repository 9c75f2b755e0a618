"""Which joints a robot's plugin or controller commands as its left and right wheels."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from itertools import chain

from kbot.kinematics.controllers import LEFT_TAGS, RIGHT_TAGS, drive_plugins, is_drive_file
from kbot.kinematics.drive import DifferentialDrive, NoDrive, named_twice, with_sides
from kbot.kinematics.steered_drive import SteeredDrive
from kbot.model import Robot
from kbot.sim.joint_control.controllers_yaml import Parameters, diff_drive_parameters
from kbot.text import Origin
from kbot.text.suggest import did_you_mean
from kbot.world.findings import Findings

_LEFT, _RIGHT = ("left_wheel_names", "left_wheel"), ("right_wheel_names", "right_wheel")
"""Parameters of diff_drive_controller: ROS 2's and ROS 1's."""
_TAGS = {"left": LEFT_TAGS, "right": RIGHT_TAGS}
_PARAMETERS = {"left": _LEFT, "right": _RIGHT}


def commanded(robot: Robot, drive: DifferentialDrive | NoDrive) -> DifferentialDrive | NoDrive:
    """The drive with the sides that the robot's controller names. A plugin's sides are in it already, and a
    plugin is what drives where the robot has both."""
    found = _controller(robot, drive)
    return with_sides(drive, _names(found, _LEFT), _names(found, _RIGHT)) if found is not None else drive


def check_named_joints(robot: Robot, drive: DifferentialDrive | NoDrive, findings: Findings) -> None:
    """Report the joints that a drive names and that are not its wheels', and those it commands wrongly."""
    groups = _sides(robot, drive)
    sides = list(chain.from_iterable(groups))
    mistakes = drive.mistakes if isinstance(drive, DifferentialDrive) else {}
    is_reported = False
    _check_named_wheels(robot, drive, sides, findings)
    for names in groups:
        lefts, rights = ([name for side, name, _ in names if side == which] for which in ("left", "right"))
        twice = named_twice(lefts, rights) if isinstance(drive, NoDrive) else None
        if twice is not None and twice[0] in robot.joints:
            origin = [origin for _, name, origin in names if name == twice[0]][1]
            message = f"the drive names {twice[1]}: the robot does not drive"
            findings.warning("W145", message, origin, "name the joint of each wheel once, on its own side")
    for _, name, origin in sides:
        if name in mistakes and not is_reported:
            findings.warning("W146", mistakes[name], origin, "see `kbot rule W146`")
            is_reported = True  # the other wheels mostly have the same mistake


def _check_named_wheels(
    robot: Robot,
    drive: DifferentialDrive | NoDrive,
    sides: Sequence[tuple[str, str, Origin]],
    findings: Findings,
) -> None:
    """Report each place where a drive names a joint that does not turn a driving wheel, or no joint at all:
    KBot then drives wheels that the plugin or controller does not drive outside KBot."""
    driving = drive.joints if isinstance(drive, DifferentialDrive) else ()
    named = {name for _, name, _ in sides}
    for side, name, origin in (*sides, *_unnamed_sides(robot, drive)):
        if not name:
            message = f"the drive names no {side} joint"
        elif name not in robot.joints:
            message = f"the drive names the joint '{name}', which the robot does not have"
        elif driving and name not in driving:
            message = f"the drive names the joint '{name}', which is not a driving wheel's joint"
        else:
            continue
        hint: str = did_you_mean(name, robot.joints) if name not in robot.joints else ""
        if isinstance(drive, DifferentialDrive):
            free = [joint for joint in driving if joint not in named]
            own = set(drive.left if side == "left" else drive.right)
            instead = " and ".join(f"'{joint}'" for joint in [j for j in free if j in own] or free)
            if instead:
                message += f": outside KBot the robot does not drive like this; KBot drives {instead} instead"
                hint = hint or f"name the joint that turns the {side} wheel: {instead}"
            else:
                message += ": KBot does not drive it"
        findings.warning("W134", message, origin, hint)


def _unnamed_sides(robot: Robot, drive: DifferentialDrive | NoDrive) -> Iterator[tuple[str, str, Origin]]:
    """Each side, with an empty name, that a plugin or controller has no tag or parameter for."""
    for plugin in drive_plugins(robot):
        tags = {element.tag for element in plugin.elements()}
        # a plugin of another kind, as gazebo_ros_control, may have a drive's name and names no joints
        is_drive = not tags.isdisjoint((*LEFT_TAGS, *RIGHT_TAGS)) or is_drive_file(plugin)
        for side, own in _TAGS.items():
            # gazebo_ros_diff_drive and gazebo_ros_skid_steer_drive have these names as defaults
            defaults = (f"{side}_joint", f"{side}_front_joint")
            if is_drive and tags.isdisjoint(own) and robot.joints.keys().isdisjoint(defaults):
                yield side, "", plugin.origin
    found = _controller(robot, drive)
    if found is not None:
        for side, keys in _PARAMETERS.items():
            if not _names(found, keys):
                yield side, "", found.place(*keys)


def _sides(robot: Robot, drive: DifferentialDrive | NoDrive) -> list[list[tuple[str, str, Origin]]]:
    """The joints that each plugin or controller names: their sides, names, and where these are written.
    The name is empty for an empty tag."""
    groups = [
        [
            ("left" if element.tag in LEFT_TAGS else "right", element.text.strip(), element.origin)
            for element in plugin.elements()
            if element.tag in (*LEFT_TAGS, *RIGHT_TAGS)
        ]
        for plugin in drive_plugins(robot)
    ]
    found = _controller(robot, drive)
    if found is not None:
        groups.append(
            [("left", name, found.place(*_LEFT)) for name in _names(found, _LEFT)]
            + [("right", name, found.place(*_RIGHT)) for name in _names(found, _RIGHT)]
        )
    return groups


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
