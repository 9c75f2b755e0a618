"""Rules about joints: limits, axes, units, mimics."""

from __future__ import annotations

import math

from kbot.checks.context import Context
from kbot.checks.edits import remove_element
from kbot.checks.registry import Finding, Found, rule
from kbot.kinematics.spatial import norm
from kbot.model import JointType
from kbot.text import Element, Fix, Related, Severity
from kbot.text.suggest import did_you_mean

_FULL_TURN = 2.0 * math.pi


@rule("J105", "axis-missing", Severity.WARNING, "robot")
def axis_missing(context: Context) -> Found:
    """A joint of type revolute, continuous, prismatic or planar has no `<axis>`.

    Why: The axis is then x, `1 0 0`. A wheel whose axle lies along y turns about the direction of travel.

    Example: `<joint name="left_wheel_joint" type="continuous"> <parent …/> <child …/> </joint>`

    Fix: Write the axis even when it is x.

    Autofix: safe: KBot writes `<axis xyz="1 0 0"/>`, the axis that the joint has now.
    """
    for joint in context.sure_joints:
        if joint.axis_origin is None and joint.type not in (JointType.FIXED, JointType.FLOATING):
            yield Finding(
                joint.origin,
                f"{joint.name}: a {joint.type} joint without <axis> has the axis x, 1 0 0",
                'write <axis xyz="…"/>, even if it is 1 0 0',
                fix=context.insert_into(
                    joint.origin, '<axis xyz="1 0 0"/>', "write the axis that the joint has", safe=True
                ),
            )


@rule("J106", "axis-zero", Severity.ERROR, "robot")
def axis_zero(context: Context) -> Found:
    """The axis of a joint has length zero.

    Why: The joint has no direction in which to move. A division by the length gives NaN, which spreads to
    every frame below the joint. The robot vanishes from rviz, and the simulation stops.

    Example: `<axis xyz="0 0 0"/>`

    Fix: Write a unit vector.

    Autofix: none.
    """
    for joint in context.sure_joints:
        if joint.axis_origin and joint.is_movable and norm(joint.axis) < 1e-9:
            if joint.type is JointType.FLOATING:
                continue
            yield Finding(joint.axis_origin, f"{joint.name}: the axis 0 0 0 has no direction")


@rule("J107", "axis-not-unit", Severity.WARNING, "robot")
def axis_not_unit(context: Context) -> Found:
    """The axis of a joint is not a unit vector.

    Why: Tools differ. Some normalise the axis. KDL, Pinocchio's parsers and hand-written kinematics have used
    it without normalising it, so a turn of 1 rad about `0 0 2` becomes 2 rad.

    Example: `<axis xyz="0 1 1"/>`, which has length 1.414.

    Fix: Divide by the length: `<axis xyz="0 0.70710678 0.70710678"/>`.

    Autofix: safe: KBot writes the same direction with length 1 if the axis consists of plain numbers.
    """
    for joint in context.sure_joints:
        length = norm(joint.axis)
        if not joint.axis_origin or not joint.is_movable or length < 1e-9:
            continue
        if abs(length - 1.0) > 1e-3 and joint.type is not JointType.FLOATING:
            by = " ".join(f"{v / length:.10g}" for v in joint.axis)
            yield Finding(
                joint.axis_origin,
                f"{joint.name}: the axis has length {length:.4g}, not 1: a turn of 1 rad may become "
                f"{length:.4g} rad",
                f'write <axis xyz="{by}"/>',
                fix=context.replace_plain(joint.axis_origin, by, "normalise the axis", safe=True),
            )


@rule("J108", "angle-in-degrees", Severity.WARNING, "document")
def angle_in_degrees(context: Context) -> Found:
    """A roll, pitch or yaw is larger than one full turn, probably because it is in degrees.

    Why: URDF angles are in radians. 90 rad is 14.3 turns and puts the frame at 116.6 degrees, without an
    error message.

    Example: `<origin xyz="0 0 0" rpy="90 0 0"/>`

    Fix: Write radians: `rpy="${pi/2} 0 0"` or `${radians(90)}`.

    Autofix: unsafe: KBot takes plain numbers for degrees and writes them in radians.
    """
    for element in context.tagged("origin"):
        if "rpy" not in element.attributes or "$" in element.attributes["rpy"]:
            continue
        values = _numbers(element.attributes["rpy"])
        worst = max((abs(v) for v in values), default=0.0)
        if worst > _FULL_TURN + 1e-3:
            turned = math.degrees(math.remainder(worst, _FULL_TURN))
            radians = " ".join(f"{math.radians(v):.10g}" for v in values)
            yield Finding(
                element.attribute_origin("rpy"),
                f"rpy {element.attributes['rpy']}: {worst:g} rad is {worst / _FULL_TURN:.1f} turns and ends "
                f"at {turned:.1f} degrees: is it in degrees instead of radians?",
                f'if it is in degrees, write rpy="{radians}"',
                fix=context.replace_plain(
                    element.attribute_origin("rpy"), radians, "read the angles as degrees", safe=False
                ),
            )


@rule("J110", "mimic-missing", Severity.ERROR, "robot")
def mimic_missing(context: Context) -> Found:
    """`<mimic>` names a joint that the robot does not have, or a fixed joint.

    Why: robot_state_publisher and joint_state_publisher skip the joint. Every frame below it is missing: "No
    transform from […]".

    Example: `<mimic joint="left_finger_jiont"/>`

    Fix: Name a movable joint of this robot.

    Autofix: safe: KBot corrects the name if it is a typo of exactly one known name.
    """
    for joint in context.sure_joints:
        if joint.mimic is None:
            continue
        leader = context.robot.joints.get(joint.mimic.joint)
        if leader is None:
            hint = did_you_mean(joint.mimic.joint, context.joint_names)
            yield Finding(
                joint.mimic.origin,
                f"{joint.name}: it mimics '{joint.mimic.joint}', which is not a joint of this robot",
                hint,
            )
        elif not leader.is_movable:
            yield Finding(
                joint.mimic.origin,
                f"{joint.name}: it mimics '{leader.name}', which is fixed",
                related=(Related("the fixed joint", leader.origin),),
            )


@rule("J111", "mimic-ring", Severity.ERROR, "robot")
def mimic_ring(context: Context) -> Found:
    """Joints mimic each other in a ring, or a joint mimics itself.

    Why: No joint of the ring has a position of its own. Publishers recurse without end, or skip all of these
    joints.

    Example: Joint a with `<mimic joint="b"/>`, joint b with `<mimic joint="a"/>`.

    Fix: Remove the `<mimic>` of one joint. The others then follow it.

    Autofix: none.
    """
    joints = context.robot.joints
    done: set[str] = set()
    for joint in context.sure_joints:
        path: list[str] = []
        at: str | None = joint.name
        while at in joints and at not in done and at is not None:
            done.add(at)
            path.append(at)
            mimic = joints[at].mimic
            at = mimic.joint if mimic else None
        if at is not None and at in path:
            ring = [*path[path.index(at) :], at]
            mimic = joints[at].mimic
            if mimic:
                yield Finding(mimic.origin, "joints mimic in a ring: " + " -> ".join(ring))


@rule("J113", "ignored-on-fixed", Severity.INFO, "robot")
def ignored_on_fixed(context: Context) -> Found:
    """A fixed joint has an `<axis>`, `<limit>`, `<dynamics>` or `<mimic>`.

    Why: These elements have no effect on a fixed joint. Either they are left over, or the joint should move.

    Example: `<joint type="fixed"> … <axis xyz="0 1 0"/> <limit …/>`

    Fix: Remove them, or give the joint the type that you meant.

    Autofix: unsafe: KBot removes the element.
    """
    for joint in context.sure_joints:
        if joint.is_movable:
            continue
        for tag, origin in (
            ("axis", joint.axis_origin if norm(joint.axis) > 0.0 else None),
            ("limit", joint.limit.origin if joint.limit else None),
            ("dynamics", joint.dynamics.origin if joint.dynamics else None),
            ("mimic", joint.mimic.origin if joint.mimic else None),
        ):
            if origin is not None:
                yield Finding(
                    origin,
                    f"{joint.name}: <{tag}> has no effect on a fixed joint",
                    "remove it, or change the type of the joint",
                    fix=_removal(context.element_at(origin)),
                )


def _removal(element: Element | None) -> Fix | None:
    return remove_element(element, safe=False) if element is not None else None


@rule("J114", "negative-dynamics", Severity.ERROR, "robot")
def negative_dynamics(context: Context) -> Found:
    """The damping or friction of a joint is negative.

    Why: Negative damping adds energy. The joint accelerates by itself until the simulation becomes unstable.

    Example: `<dynamics damping="-0.1" friction="0"/>`

    Fix: Remove the sign.

    Autofix: none.
    """
    for joint in context.sure_joints:
        if joint.dynamics is None:
            continue
        for name, value in (("damping", joint.dynamics.damping), ("friction", joint.dynamics.friction)):
            if value < 0.0:
                yield Finding(
                    joint.dynamics.origin,
                    f"{joint.name}: {name} {value:g} is negative: it drives the joint instead of braking it",
                )


def _numbers(text: str) -> list[float]:
    try:
        values = [float(word) for word in text.split()]
    except ValueError:
        return []
    return [v for v in values if math.isfinite(v)]
