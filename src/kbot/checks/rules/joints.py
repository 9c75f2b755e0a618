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

_LIMITED = (JointType.REVOLUTE, JointType.PRISMATIC)
_FULL_TURN = 2.0 * math.pi


@rule("J105", "axis-missing", Severity.WARNING, "robot")
def axis_missing(context: Context) -> Found:
    """A revolute, continuous, prismatic or planar joint without `<axis>`.

    Why: the axis is then x, `1 0 0`: a wheel whose axle lies along y rolls about the direction of
    travel instead.

    Example: `<joint name="left_wheel_joint" type="continuous"> <parent …/> <child …/> </joint>`

    Fix: write the axis, even where it is x.

    Autofix: safe: `<axis xyz="1 0 0"/>`, which is what the joint has, is written out.
    """
    for joint in context.sure_joints:
        if joint.axis_origin is None and joint.type not in (JointType.FIXED, JointType.FLOATING):
            yield Finding(
                joint.origin,
                f"{joint.name}: a {joint.type} joint without <axis> has the axis x, 1 0 0",
                'write <axis xyz="…"/>, even where it is 1 0 0',
                fix=context.insert_into(
                    joint.origin, '<axis xyz="1 0 0"/>', "write the axis the joint has", safe=True
                ),
            )


@rule("J106", "axis-zero", Severity.ERROR, "robot")
def axis_zero(context: Context) -> Found:
    """A joint whose axis has no length.

    Why: there is no direction to move in. Dividing by its length gives NaN, which spreads to every
    frame behind the joint: the robot vanishes from rviz, the simulation stops.

    Example: `<axis xyz="0 0 0"/>`

    Fix: write a unit vector.

    Autofix: none.
    """
    for joint in context.sure_joints:
        if joint.axis_origin and joint.is_movable and norm(joint.axis) < 1e-9:
            if joint.type is JointType.FLOATING:
                continue
            yield Finding(joint.axis_origin, f"{joint.name}: the axis 0 0 0 has no direction")


@rule("J107", "axis-not-unit", Severity.WARNING, "robot")
def axis_not_unit(context: Context) -> Found:
    """A joint whose axis is not of length 1.

    Why: consumers differ. Some normalise; KDL, Pinocchio's readers and hand-written kinematics have
    used it as it stands, so that a turn of 1 rad comes out as 2 rad for `0 0 2`.

    Example: `<axis xyz="0 1 1"/>`, which is 1.414 long.

    Fix: divide by the length: `<axis xyz="0 0.70710678 0.70710678"/>`.

    Autofix: safe: the same direction, of length 1, is written when the axis is plain numbers.
    """
    for joint in context.sure_joints:
        length = norm(joint.axis)
        if not joint.axis_origin or not joint.is_movable or length < 1e-9:
            continue
        if abs(length - 1.0) > 1e-3 and joint.type is not JointType.FLOATING:
            by = " ".join(f"{v / length:.10g}" for v in joint.axis)
            yield Finding(
                joint.axis_origin,
                f"{joint.name}: the axis is {length:.4g} long, not 1: a turn of 1 rad may come out as "
                f"{length:.4g} rad",
                f'<axis xyz="{by}"/>',
                fix=context.replace_plain(joint.axis_origin, by, "make the axis of length 1", safe=True),
            )


@rule("J108", "angle-in-degrees", Severity.WARNING, "document")
def angle_in_degrees(context: Context) -> Found:
    """A roll, pitch or yaw beyond one full turn: degrees where radians are meant.

    Why: 90 rad is 14.3 turns: the frame ends up 116.6 degrees round, not 90, and nothing says so.

    Example: `<origin xyz="0 0 0" rpy="90 0 0"/>`

    Fix: write radians: `rpy="${pi/2} 0 0"`, or `${radians(90)}`.

    Autofix: unsafe: plain numbers are taken for degrees and written in radians.
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
                f"rpy {element.attributes['rpy']}: {worst:g} rad is {worst / _FULL_TURN:.1f} turns "
                f"(it ends at {turned:.1f} degrees): degrees where radians are meant?",
                f'as degrees it is rpy="{radians}"',
                fix=context.replace_plain(
                    element.attribute_origin("rpy"), radians, "read the angles as degrees", safe=False
                ),
            )


@rule("J110", "mimic-missing", Severity.ERROR, "robot")
def mimic_missing(context: Context) -> Found:
    """A `<mimic>` of a joint that the robot lacks, or of one that cannot move.

    Why: robot_state_publisher and joint_state_publisher leave the joint out, and every frame behind
    it goes missing: "No transform from […]".

    Example: `<mimic joint="left_finger_jiont"/>`

    Fix: name a joint of this robot that moves.

    Autofix: safe, where the name is a slip of one known name: it is written.
    """
    for joint in context.sure_joints:
        if joint.mimic is None:
            continue
        leader = context.robot.joints.get(joint.mimic.joint)
        if leader is None:
            hint = did_you_mean(joint.mimic.joint, context.robot.joints)
            yield Finding(
                joint.mimic.origin, f"{joint.name}: it mimics '{joint.mimic.joint}', which is no joint", hint
            )
        elif not leader.is_movable:
            yield Finding(
                joint.mimic.origin,
                f"{joint.name}: it mimics '{leader.name}', which is fixed",
                related=(Related("the fixed joint", leader.origin),),
            )


@rule("J111", "mimic-ring", Severity.ERROR, "robot")
def mimic_ring(context: Context) -> Found:
    """Joints that mimic each other in a ring, or a joint that mimics itself.

    Why: no joint of the ring has a position of its own; publishers recurse, or leave all of them out.

    Example: joint a with `<mimic joint="b"/>`, joint b with `<mimic joint="a"/>`

    Fix: let one joint lead.

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
    """A fixed joint with `<axis>`, `<limit>`, `<dynamics>` or `<mimic>`.

    Why: none of it has a meaning there. Either it is left over, or the joint was meant to move.

    Example: `<joint type="fixed"> … <axis xyz="0 1 0"/> <limit …/>`

    Fix: remove them, or give the joint the type it was meant to have.

    Autofix: unsafe: the element is removed.
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
                    f"{joint.name}: <{tag}> means nothing on a fixed joint",
                    "remove it, or give the joint the type it was meant to have",
                    fix=_removal(context.element_at(origin)),
                )


def _removal(element: Element | None) -> Fix | None:
    return remove_element(element, safe=False) if element is not None else None


@rule("J114", "negative-dynamics", Severity.ERROR, "robot")
def negative_dynamics(context: Context) -> Found:
    """Negative damping or friction.

    Why: it feeds energy in: the joint speeds itself up until the simulation blows up.

    Example: `<dynamics damping="-0.1" friction="0"/>`

    Fix: remove the sign.

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
