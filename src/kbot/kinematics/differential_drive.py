"""Differential drive, found from the model: which joints drive, how large the wheels, how far apart."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from kbot.kinematics.casters import find_casters
from kbot.kinematics.controllers import plugin_driven_joints, plugin_sides, velocity_joints
from kbot.kinematics.drive import DifferentialDrive, NoDrive, named_twice, with_sides
from kbot.kinematics.frames import FrameTree, unit_axis
from kbot.kinematics.steering import steered_axle, steered_wheel
from kbot.kinematics.transform import Transform
from kbot.kinematics.wheels import NoWheel, Wheel, carrier, find_wheel, movable_ancestor
from kbot.model import Joint, JointType, Robot

__all__ = ["DifferentialDrive", "NoDrive", "base_link", "drive_of", "find_drive"]

Array = NDArray[np.float64]

_EQUAL = 0.1
"""By how much of a wheel's radius two wheels of a pair may differ in size, and stand apart in x and z."""


def find_drive(robot: Robot, tree: FrameTree | None = None) -> DifferentialDrive | NoDrive:
    """The robot's differential drive.

    Joints that a drive plugin names come first, then those that ros2_control commands by velocity;
    where none is named, the largest wheels that come in pairs drive: those that hang rigidly on the
    base, else those on a suspension. Never raises.
    """
    tree = tree or FrameTree(robot)
    turning = [j for j in robot.joints.values() if j.type is JointType.CONTINUOUS]
    left, right = plugin_sides(robot)
    by_plugin = drive_of(robot, tree, plugin_driven_joints(robot))
    if isinstance(by_plugin, DifferentialDrive) or named_twice(left, right) is not None:
        return with_sides(by_plugin, left, right)
    if not turning:
        return NoDrive(_why_nothing_turns(robot))
    steered = steered_axle(robot, tree, turning)
    if steered:
        return NoDrive(steered)
    rigid = [joint for joint in turning if movable_ancestor(robot, joint) is None]
    suspended = [joint for joint in turning if joint not in rigid and _is_suspended(tree, joint)]
    result: DifferentialDrive | NoDrive | None = None
    for joints in (velocity_joints(robot), rigid, suspended):
        if joints:
            found = drive_of(robot, tree, joints)
            if isinstance(found, DifferentialDrive):
                turned = steered_wheel(tree, found)
                return NoDrive(turned) if turned else found
            result = result or found
    return result or NoDrive(f"'{turning[0].name}' turns, but hangs on another joint that moves")


def base_link(robot: Robot, wheel_parent: str) -> str:
    """The frame odometry is reckoned in: `base_footprint`, else `base_link`, else the root, of those held
    rigidly to the body that carries the wheels (REP 105)."""
    body = carrier(robot, wheel_parent)
    for name in ("base_footprint", "base_link"):
        if name in robot.links and carrier(robot, name) == body:
            return name
    return body


def _why_nothing_turns(robot: Robot) -> str:
    others = [f"'{j.name}' is {j.type}" for j in robot.joints.values() if j.is_movable]
    if not others:
        return "the robot has no joint that moves"
    more = f" and {len(others) - 3} more" if len(others) > 3 else ""
    return f"no joint is continuous, as a wheel's is: {', '.join(others[:3])}{more}"


def _is_suspended(tree: FrameTree, joint: Joint) -> bool:
    """Whether only springs and rockers are between the joint and the root: nothing that turns it aside."""
    robot = tree.robot
    above = movable_ancestor(robot, joint)
    while above is not None:
        axis = tree.pose(above.child).rotation @ unit_axis(above)
        rocks = above.type is JointType.REVOLUTE and abs(axis[2]) < 0.5
        if not rocks and above.type is not JointType.PRISMATIC:
            return False
        above = movable_ancestor(robot, above)
    return True


def drive_of(robot: Robot, tree: FrameTree, joints: Sequence[Joint]) -> DifferentialDrive | NoDrive:
    """The drive made by the wheels on some of `joints`."""
    if not joints:
        return NoDrive("no joint is named to drive")
    base = base_link(robot, joints[0].parent)
    found = [find_wheel(tree, joint, base) for joint in joints]
    wheels = [w for w in found if isinstance(w, Wheel)]
    if not wheels:
        first = next(w for w in found if isinstance(w, NoWheel))
        return NoDrive(f"no joint turns a wheel: '{first.joint}': {first.reason}")
    pairs = _pairs(wheels)
    if not pairs:
        return NoDrive(_why_no_pair(wheels, [w for w in found if isinstance(w, NoWheel)]))
    largest = max(left.radius for left, _ in pairs)
    driving = [p for p in pairs if p[0].radius > (1.0 - _EQUAL) * largest]
    return _build(tree, base, driving)


def _why_no_pair(wheels: Sequence[Wheel], others: Sequence[NoWheel]) -> str:
    reason = f"'{wheels[0].joint}' has no wheel of equal size across from it"
    if others:
        reason += f"; '{others[0].joint}': {others[0].reason}"
    return reason


def _leftward(axis: Array) -> Array:
    """The level unit vector along an axle that points left; forward is then nearest to x, else to y."""
    level = np.array([axis[0], axis[1], 0.0]) / math.hypot(axis[0], axis[1])
    forward_x, forward_y = level[1], -level[0]
    ahead = forward_x if abs(forward_x) > 1e-3 else forward_y
    return level if ahead > 0.0 else -level


def _pairs(wheels: Sequence[Wheel]) -> list[tuple[Wheel, Wheel]]:
    """Wheels of equal size on one line along their axles, (left, right), front to rear."""
    pairs: list[tuple[float, Wheel, Wheel]] = []
    left_over = list(wheels)
    while left_over:
        first = left_over.pop(0)
        partner = next((w for w in left_over if _is_pair(first, w)), None)
        if partner is None:
            continue
        left_over.remove(partner)
        leftward = _leftward(first.axis)
        if (first.center - partner.center) @ leftward < 0.0:
            first, partner = partner, first
        forward = np.cross(leftward, (0.0, 0.0, 1.0))
        pairs.append((-float(first.center @ forward), first, partner))
    return [(left, right) for _, left, right in sorted(pairs, key=lambda p: p[0])]


def _is_pair(a: Wheel, b: Wheel) -> bool:
    near = _EQUAL * max(a.radius, b.radius)
    if abs(a.radius - b.radius) > near or abs(a.axis @ b.axis) < 0.99:
        return False
    between = b.center - a.center
    along = float(between @ a.axis)
    off_line = float(np.linalg.norm(between - along * a.axis))
    return off_line <= near and abs(along) > max(a.width, b.width) / 2.0


def _build(tree: FrameTree, base: str, pairs: Sequence[tuple[Wheel, Wheel]]) -> DifferentialDrive:
    lefts, rights = [left for left, _ in pairs], [right for _, right in pairs]
    leftward = _leftward(lefts[0].axis)
    middle_left = np.mean([w.center for w in lefts], axis=0)
    middle_right = np.mean([w.center for w in rights], axis=0)
    forward = np.cross(leftward, (0.0, 0.0, 1.0))
    rotation = np.column_stack([forward, leftward, (0.0, 0.0, 1.0)])
    axle = Transform.from_rotation_translation(rotation, (middle_left + middle_right) / 2.0)
    wheels = {w.joint: w for w in lefts + rights}
    radius = float(np.mean([w.radius for w in wheels.values()]))
    ground = float(axle.translation[2]) - radius
    return DifferentialDrive(
        left=tuple(w.joint for w in lefts),
        right=tuple(w.joint for w in rights),
        forward={name: 1.0 if w.axis @ leftward > 0.0 else -1.0 for name, w in wheels.items()},
        wheels=wheels,
        radius=radius,
        separation=float((middle_left - middle_right) @ leftward),
        base=base,
        axle_in_base=axle,
        casters=find_casters(tree, base, ground, radius, {w.link for w in wheels.values()}),
    )
