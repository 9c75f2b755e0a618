"""Rules about drive wheels: their sides, axes, sizes and places."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator

from kbot.checks.context import Context
from kbot.checks.facts.bodies import LinkShape, axis_of
from kbot.checks.registry import Finding, Found, reported, rule
from kbot.checks.rules.geometry import overlap
from kbot.kinematics.drive.findings import EXCHANGE_PLACES, UNEQUAL, axis_faults
from kbot.kinematics.drive.part_names import side_of
from kbot.kinematics.drive.wheels import MOST_JOINTS, Pair, Wheel, rigid_links
from kbot.model import Joint, JointType, Mesh
from kbot.text import Origin, Related, Severity

_ALIGNED = 0.985
"""Cosine of 10 degrees, by which axes may differ."""


def _axis_origin(joint: Joint) -> Origin:
    return joint.axis_origin or joint.origin


def at_both(pair: Pair, place: Callable[[Joint], Origin]) -> Iterator[tuple[Wheel, Origin]]:
    """The places for a finding that both wheels share: that of the left wheel, and that of the right wheel if
    one macro made both. Findings of every call show that the fault is the macro's."""
    left, right = place(pair.left.joint), place(pair.right.joint)
    yield pair.left, left
    if left.span == right.span:
        yield pair.right, right


def pose_origin(joint: Joint) -> Origin:
    return joint.pose.origin or joint.origin


@rule("D107", "wheels-exchanged", Severity.WARNING, "robot")
def wheels_exchanged(context: Context) -> Found:
    """A wheel that is named left is on the right, or the other way round.

    Why: y points left (REP 103). To turn left, a controller speeds up the wheel that is named right, and the
    robot turns right. Odometry reports the opposite rotation, and navigation makes the robot spin.

    Example: `<xacro:wheel prefix="left" reflect="-1"/>`

    Fix: If the joint names are right, swap the signs of the wheels' y coordinates. If the plugin or
    controller names them in the wrong order, swap the names in `<leftJoint>` and `<rightJoint>`.

    Autofix: none.
    """
    by_controllers = list(reported(context.drive_findings, "D107"))
    yield from by_controllers
    for pair in context.level_pairs:
        left, right = pair.left, pair.right
        named = side_of(left.joint.name) == "left" and side_of(right.joint.name) == "right"
        if not named and not _named_sides(context, pair):
            continue
        if left.center[1] < right.center[1] and (named or not by_controllers):
            yield Finding(
                left.joint.pose.origin or left.joint.origin,
                f"{left.joint.name}: its wheel is at y = {left.center[1] * 1e3:.4g} mm, to the right of "
                f"'{right.joint.name}' at {right.center[1] * 1e3:.4g} mm: turns are reversed",
                EXCHANGE_PLACES,
                (Related(f"'{right.joint.name}'", right.joint.pose.origin or right.joint.origin),),
            )


def _named_sides(context: Context, pair: Pair) -> bool:
    for controller in context.declared_drives:
        lefts = {joint.text for joint in controller.left}
        rights = {joint.text for joint in controller.right}
        if pair.left.joint.name in lefts and pair.right.joint.name in rights:
            return True
    return False


@rule("D108", "wheel-axes-opposed", Severity.WARNING, "robot")
def wheel_axes_opposed(context: Context) -> Found:
    """The axes of the two wheels of a pair point in opposite directions.

    Why: Equal joint speeds then turn the wheels in opposite directions. A robot that should drive straight
    spins on the spot, unless its controller accounts for the axes.

    Example: `<axis xyz="0 ${reflect} 0"/>` in a macro called with 1 and -1.

    Fix: Let both axes point along +y of the base frame.

    Autofix: none.
    """
    return reported(axis_faults(context.wheel_pairs), "D108")


@rule("D109", "wheels-drive-backwards", Severity.WARNING, "robot")
def wheels_drive_backwards(context: Context) -> Found:
    """The axes of both wheels point along -y.

    Why: A positive joint speed then drives the robot backwards. diff_drive controllers expect positive speeds
    to drive forwards. The robot drives away from its goal, while its odometry reports that it comes nearer.

    Example: `<axis xyz="0 -1 0"/>`

    Fix: Write `<axis xyz="0 1 0"/>`.

    Autofix: none.
    """
    return reported(axis_faults(context.wheel_pairs), "D109")


@rule("D132", "drives-sideways", Severity.WARNING, "robot")
def drives_sideways(context: Context) -> Found:
    """The wheels roll more than 25 degrees off the x axis of the base.

    Why: In ROS, x points forward (REP 103). `cmd_vel` and odometry mean it, and so do planners. The robot
    drives in another direction than its odometry reports, so it misses its goals and the map is wrong.

    Example: Wheels in front of and behind `base_link`, with axles along its x axis.

    Fix: Turn the wheels about z so that their axles lie along y, or add a link `base_link` above the robot,
    with a fixed joint that turns the robot.

    Autofix: none.
    """
    return reported(context.drive_findings, "D132")


@rule("D110", "wheel-axis-askew", Severity.WARNING, "drive")
def wheel_axis_askew(context: Context) -> Found:
    """The joint axis of a drive wheel is not parallel to y, or not aligned with the wheel's cylinder.

    Why: A wheel that turns about an axis other than its own wobbles or tumbles. A wheel whose axle is not
    along y drags sideways as it rolls.

    Example: A cylinder that lies along y on a joint with `<axis xyz="1 0 0"/>`.

    Fix: Align axis and cylinder: axis `0 1 0` and a geometry with `rpy="${pi/2} 0 0"`.

    Autofix: none.
    """
    for pair in context.level_pairs:
        for wheel in pair.wheels:
            if not wheel.axis.any() or wheel.joint.type is JointType.FIXED:
                continue
            link, part = _part(context, wheel)
            own = axis_of(part) if part else None
            if part is not None and own is not None:
                along = abs(float(wheel.axis @ context.frames[link].direction(own)))
                if along < _ALIGNED:
                    angle = math.degrees(math.acos(min(1.0, along)))
                    yield Finding(
                        _axis_origin(wheel.joint),
                        f"{wheel.joint.name}: its axis is {angle:.3g} degrees from the axis of its cylinder: "
                        "the wheel tumbles",
                        related=(Related("the cylinder", part.origin),),
                    )
                    continue
            if abs(wheel.axis[1]) < _ALIGNED:
                angle = math.degrees(math.acos(min(1.0, abs(wheel.axis[1]))))
                yield Finding(
                    _axis_origin(wheel.joint),
                    f"{wheel.joint.name}: its axis is {angle:.3g} degrees from the y axis of the base: "
                    "the wheel drags sideways",
                )


def _part(context: Context, wheel: Wheel) -> tuple[str, LinkShape | None]:
    """The shape that gives a wheel its size, and its link, which may be fixed to the wheel's link."""
    for link in rigid_links(context.robot, wheel.link):
        for part in context.bodies[link].parts:
            if part.geometry is wheel.shape:
                return link, part
    return wheel.link, None


@rule("D111", "wheels-not-mirrored", Severity.WARNING, "drive")
def wheels_not_mirrored(context: Context) -> Found:
    """The two wheels of a pair are not mirror images in place, size or mass.

    Why: If the radii differ by 1 %, a robot with a track of 17 cm drives a circle of 17 m radius instead of
    straight ahead. If the axles are not in line, the wheels scrub. A heavier wheel takes longer
    to accelerate and brake.

    Example: The left wheel at `x="0.02"`, the right wheel at `x="0.025"`.

    Fix: Make both wheels with one macro that takes a sign.

    Autofix: none.
    """
    for pair in context.base.pairs:
        left, right = pair.left, pair.right
        if math.dist(left.center, right.center) < 0.1 * left.radius:
            yield Finding(
                pose_origin(right.joint),
                f"{left.joint.name} and {right.joint.name}: both wheels are at the same place",
                "correct the sign of one of them",
                (Related(f"'{left.joint.name}'", pose_origin(left.joint)),),
            )
    links = context.robot.links
    for pair in context.level_pairs:
        left, right = pair.left, pair.right
        size = max(left.radius, right.radius) or 0.05
        known = size if left.shape and right.shape else math.inf
        differences: list[str] = []
        for what, a, b, tolerance in (
            ("x", left.center[0], right.center[0], max(5e-4, 0.01 * size)),
            ("z", left.center[2], right.center[2], max(5e-4, 0.01 * size)),
            ("y (from the middle)", abs(left.center[1]), abs(right.center[1]), max(1e-3, 0.02 * size)),
            ("radius", left.radius, right.radius, UNEQUAL * known),
            ("width", left.width, right.width, 0.02 * known),
        ):
            if abs(a - b) > tolerance:
                differences.append(f"{what} {a * 1e3:.4g} and {b * 1e3:.4g} mm")
        first, second = links[left.link].inertial, links[right.link].inertial
        if first and second and abs(first.mass - second.mass) > 0.02 * max(first.mass, second.mass):
            differences.append(f"mass {first.mass:.4g} and {second.mass:.4g} kg")
        if differences:
            yield Finding(
                right.joint.pose.origin or right.joint.origin,
                f"{left.joint.name} and {right.joint.name} are not mirror images: " + "; ".join(differences),
                "make both with one macro",
                (Related(f"'{left.joint.name}'", left.joint.pose.origin or left.joint.origin),),
            )


@rule("D114", "wheel-in-chassis", Severity.INFO, "drive")
def wheel_in_chassis(context: Context) -> Found:
    """A drive wheel is inside a shape of the link that carries it.

    Why: Simulators ignore contacts between a link and its child, so the overlap has no effect there. The
    wheel is hidden, however. If another link is inserted between the wheel and the chassis, the simulator
    pushes them apart.

    Example: A chassis box 20 cm wide with wheels 15 cm apart and no wheel wells.

    Fix: Move the wheels out, or build the collision from several boxes.

    Autofix: none.
    """
    for pair in context.level_pairs:
        for wheel in pair.wheels:
            joint = wheel.joint
            link, own = _part(context, wheel)
            if own is None or joint.parent in context.unsure:
                continue
            for part in context.bodies[joint.parent].collisions or context.bodies[joint.parent].visuals:
                if isinstance(part.geometry, Mesh):
                    continue
                depth = overlap(context, link, own, joint.parent, part)
                if depth > 0.5 * wheel.width or depth > 0.25 * wheel.radius:
                    yield Finding(
                        joint.pose.origin or joint.origin,
                        f"{wheel.link}: the wheel reaches {depth * 1e3:.3g} mm into '{joint.parent}'",
                        related=(Related(f"the shape of '{joint.parent}'", part.origin),),
                    )
                    break


@rule("K003", "not-checked", Severity.INFO, "robot")
def not_checked(context: Context) -> Found:
    """A robot of a launch file, or the drive of a robot, is not checked because it would take too long.

    Why: The drive rules (D…) compare each wheel with every other wheel, which takes too long for thousands of
    joints. A launch file may start hundreds of robots. Without this finding they would seem to have passed.

    Example: A robot with 1001 joints, one of which is continuous or driven by a plugin.

    Fix: Check a description that contains only the drive. For example, leave out the arms with `<xacro:if>`.
    Check the other robots of a launch file separately, by naming their description files.

    Autofix: none.
    """
    joints = context.robot.joints.values()
    if len(joints) <= MOST_JOINTS:
        return
    if context.declared_drives or any(joint.type is JointType.CONTINUOUS for joint in joints):
        yield Finding(
            context.root.origin,
            f"the drive is not checked: the robot has more than {MOST_JOINTS} joints",
            "check a description with fewer joints",
        )
