"""Rules about joints: limits, axes, units, mimics."""

from __future__ import annotations

import math

from kbot.checks.context import Context
from kbot.checks.fixing import remove_attributes, remove_element
from kbot.checks.registry import Finding, Found, rule
from kbot.checks.spatial import norm
from kbot.model import Joint, JointType
from kbot.text import Element, Fix, Related, Severity
from kbot.text.suggest import did_you_mean

_LIMITED = (JointType.REVOLUTE, JointType.PRISMATIC)
_FULL_TURN = 2.0 * math.pi


def _unit(joint: Joint) -> str:
    return "m" if joint.type is JointType.PRISMATIC else "rad"


@rule("J101", "missing-limit", Severity.ERROR, "robot")
def missing_limit(context: Context) -> Found:
    """A revolute or prismatic joint without `<limit>`.

    Why: urdfdom refuses the whole robot ("joint is of type REVOLUTE but it does not specify limits"):
    nothing is loaded, by no tool that is built on it.

    Example: `<joint name="arm" type="revolute"> <axis xyz="0 0 1"/> … </joint>`

    Mend: add `<limit lower="-1.57" upper="1.57" effort="10" velocity="1"/>`, or make the joint
    `continuous` when it may turn without end.

    Fix: none; nobody but the author knows the limits.
    """
    for joint in context.sure_joints:
        if joint.type in _LIMITED and joint.limit is None:
            hint = 'add <limit lower="…" upper="…" effort="…" velocity="…"/>'
            if joint.type is JointType.REVOLUTE:
                hint += ', or use type="continuous" for a joint that turns without end'
            yield Finding(joint.origin, f"{joint.name}: a {joint.type} joint needs a <limit>", hint)


@rule("J102", "limit-reversed", Severity.ERROR, "robot")
def limit_reversed(context: Context) -> Found:
    """A joint whose lower limit is above its upper one.

    Why: no position satisfies both. Simulators clamp to one end, refuse, or throw the joint from one
    stop to the other; MoveIt calls every state of the robot invalid.

    Example: `<limit lower="1.57" upper="-1.57" effort="10" velocity="1"/>`

    Mend: exchange the two.

    Fix: unsafe: the two values are exchanged, which is right unless one has a wrong sign.
    """
    for joint in context.sure_joints:
        limit = joint.limit
        if limit and joint.type in _LIMITED and (limit.lower or 0.0) > (limit.upper or 0.0):
            low, high = limit.lower or 0.0, limit.upper or 0.0
            yield Finding(
                limit.origin,
                f"{joint.name}: the lower limit {low:.6g} {_unit(joint)} is above the upper one "
                f"{high:.6g} {_unit(joint)}: no position is allowed",
                "exchange lower and upper",
                fix=context.exchange(limit.origin, "lower", "upper"),
            )


@rule("J103", "limit-closed", Severity.WARNING, "robot")
def limit_closed(context: Context) -> Found:
    """A movable joint whose limits leave it no room: lower and upper are equal.

    Why: the joint is published, planned for and simulated as movable, and never moves; a solver
    spends its iterations on a stop hit from both sides. `<limit effort=… velocity=…/>` alone means
    lower = upper = 0.

    Example: `<joint type="revolute"> … <limit effort="10" velocity="1"/> </joint>`

    Mend: give lower and upper, or make the joint `fixed`, or `continuous`.

    Fix: none.
    """
    for joint in context.sure_joints:
        limit = joint.limit
        if not limit or joint.type not in _LIMITED or joint.mimic:
            continue
        low, high = limit.lower or 0.0, limit.upper or 0.0
        if low == high:
            given = "lower and upper are not given, which means 0"
            if limit.lower is not None or limit.upper is not None:
                given = f"lower and upper are both {low:.6g} {_unit(joint)}"
            yield Finding(
                limit.origin,
                f"{joint.name}: {given}: the joint cannot move",
                "give a range, or make the joint fixed",
            )


@rule("J104", "no-effort", Severity.WARNING, "robot")
def no_effort(context: Context) -> Found:
    """A movable joint whose effort or velocity limit is 0.

    Why: 0 is not "no limit". ros2_control, Gazebo and MoveIt take it at its word: a joint with 0 N m
    never accelerates, one with 0 rad/s may not turn, and a trajectory over it takes for ever.

    Example: `<limit lower="-1" upper="1" effort="0" velocity="0"/>`

    Mend: write what the motor can do: its stall torque in N m and its speed in rad/s (N and m/s for a
    prismatic joint).

    Fix: none.
    """
    for joint in context.sure_joints:
        limit = joint.limit
        if not limit or not joint.has_position or joint.mimic:
            continue
        dead = [
            (name, unit)
            for name, value, unit in (
                ("effort", limit.effort, "N" if joint.type is JointType.PRISMATIC else "N m"),
                ("velocity", limit.velocity, "m/s" if joint.type is JointType.PRISMATIC else "rad/s"),
            )
            if value is not None and value == 0.0
        ]
        if dead:
            what = " and ".join(f"{name} 0 {unit}" for name, unit in dead)
            yield Finding(
                limit.origin,
                f"{joint.name}: {what} is no 'unlimited': a consumer that keeps to it never moves the joint",
                "write what the motor can do",
            )


@rule("J105", "axis-missing", Severity.WARNING, "robot")
def axis_missing(context: Context) -> Found:
    """A revolute, continuous, prismatic or planar joint without `<axis>`.

    Why: the axis is then x, `1 0 0`: a wheel whose axle lies along y rolls about the direction of
    travel instead.

    Example: `<joint name="left_wheel_joint" type="continuous"> <parent …/> <child …/> </joint>`

    Mend: write the axis, even where it is x.

    Fix: safe: `<axis xyz="1 0 0"/>`, which is what the joint has, is written out.
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

    Mend: write a unit vector.

    Fix: none.
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

    Mend: divide by the length: `<axis xyz="0 0.70710678 0.70710678"/>`.

    Fix: safe: the same direction, of length 1, is written when the axis is plain numbers.
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

    Mend: write radians: `rpy="${pi/2} 0 0"`, or `${radians(90)}`.

    Fix: unsafe: plain numbers are taken for degrees and written in radians.
    """
    for element in context.elements:
        if element.tag != "origin" or "rpy" not in element.attributes or "$" in element.attributes["rpy"]:
            continue
        values = _numbers(element.attributes["rpy"])
        worst = max((abs(v) for v in values), default=0.0)
        if worst > _FULL_TURN + 1e-3:
            turned = math.degrees(math.remainder(worst, _FULL_TURN))
            radians = " ".join(f"{math.radians(v):.10g}" for v in values)
            yield Finding(
                element.attribute_origin("rpy"),
                f"rpy {element.attributes['rpy']}: {worst:g} rad is {worst / _FULL_TURN:.1f} turns (it "
                "ends at "
                f"{turned:.1f} degrees): degrees where radians are meant?",
                f'as degrees it is rpy="{radians}"',
                fix=context.replace_plain(
                    element.attribute_origin("rpy"), radians, "read the angles as degrees", safe=False
                ),
            )


@rule("J109", "limit-in-degrees", Severity.WARNING, "robot")
def limit_in_degrees(context: Context) -> Found:
    """A revolute joint that may turn more than two full turns either way: degrees for radians.

    Why: limits of -90..90 rad let the joint turn 14 times round; its stop does not exist, and a
    planner may go the long way.

    Example: `<limit lower="-90" upper="90" effort="10" velocity="1"/>`

    Mend: write radians; for a joint that may turn without end use `continuous`.

    Fix: none.
    """
    for joint in context.sure_joints:
        limit = joint.limit
        if limit is None or joint.type is not JointType.REVOLUTE:
            continue
        worst = max(abs(limit.lower or 0.0), abs(limit.upper or 0.0))
        if 2.0 * _FULL_TURN < worst < 1e4:
            yield Finding(
                limit.origin,
                f"{joint.name}: {worst:g} rad is {worst / _FULL_TURN:.1f} turns: degrees where radians "
                "are meant?",
                f"as degrees it is {math.radians(worst):.4f} rad",
            )


@rule("J110", "mimic-missing", Severity.ERROR, "robot")
def mimic_missing(context: Context) -> Found:
    """A `<mimic>` of a joint that the robot lacks, or of one that cannot move.

    Why: robot_state_publisher and joint_state_publisher leave the joint out, and every frame behind
    it goes missing: "No transform from […]".

    Example: `<mimic joint="left_finger_jiont"/>`

    Mend: name a joint of this robot that moves.

    Fix: none.
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

    Mend: let one joint lead.

    Fix: none.
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


@rule("J112", "limit-on-continuous", Severity.INFO, "robot")
def limit_on_continuous(context: Context) -> Found:
    """Position limits on a continuous joint.

    Why: urdfdom ignores lower and upper of a continuous joint: whoever wrote them expects a stop
    that is not there.

    Example: `<joint type="continuous"> … <limit lower="-1" upper="1" effort="5" velocity="2"/>`

    Mend: make the joint `revolute` to have the stop; else leave lower and upper out.

    Fix: unsafe: lower and upper are removed.
    """
    for joint in context.sure_joints:
        limit = joint.limit
        if limit is None or joint.type is not JointType.CONTINUOUS:
            continue
        low, high = limit.lower or 0.0, limit.upper or 0.0
        if (low, high) != (0.0, 0.0) and max(abs(low), abs(high)) < 1e4:
            yield Finding(
                limit.origin,
                f"{joint.name}: a continuous joint has no stops; {low:.4g}..{high:.4g} rad is ignored",
                'use type="revolute" to have them, or leave lower and upper out',
                fix=remove_attributes(context.element_at(limit.origin), ("lower", "upper"), safe=False),
            )


@rule("J113", "ignored-on-fixed", Severity.INFO, "robot")
def ignored_on_fixed(context: Context) -> Found:
    """A fixed joint with `<axis>`, `<limit>`, `<dynamics>` or `<mimic>`.

    Why: none of it has a meaning there. Either it is left over, or the joint was meant to move.

    Example: `<joint type="fixed"> … <axis xyz="0 1 0"/> <limit …/>`

    Mend: remove them, or give the joint the type it was meant to have.

    Fix: unsafe: the element is removed.
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

    Mend: remove the sign.

    Fix: none.
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


@rule("J115", "zero-out-of-limits", Severity.INFO, "robot")
def zero_out_of_limits(context: Context) -> Found:
    """A joint whose limits leave 0 out.

    Why: at 0 is where joint_state_publisher, Gazebo and MoveIt put a joint that nobody has said
    anything about; this one starts outside its own limits, and is thrown to a stop or refused.

    Example: `<limit lower="0.5" upper="1.5" effort="10" velocity="1"/>`

    Mend: set the joint's frame so that 0 lies within, or give an initial position where the robot is
    started.

    Fix: none.
    """
    for joint in context.sure_joints:
        limit = joint.limit
        if limit is None or joint.type not in _LIMITED or joint.mimic:
            continue
        low, high = limit.lower or 0.0, limit.upper or 0.0
        if low <= high and not low - 1e-6 <= 0.0 <= high + 1e-6:
            yield Finding(
                limit.origin,
                f"{joint.name}: 0 lies outside {low:.4g}..{high:.4g} {_unit(joint)}, where every tool "
                "starts it",
            )


def _numbers(text: str) -> list[float]:
    try:
        values = [float(word) for word in text.split()]
    except ValueError:
        return []
    return [v for v in values if math.isfinite(v)]
