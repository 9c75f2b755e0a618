"""Rules about the limits of joints."""

from __future__ import annotations

import math

from kbot.checks.context import Context
from kbot.checks.edits import remove_attributes
from kbot.checks.registry import Finding, Found, rule
from kbot.model import Joint, JointType
from kbot.text import Severity

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

    Fix: add `<limit lower="-1.57" upper="1.57" effort="10" velocity="1"/>`, or make the joint
    `continuous` when it may turn without end.

    Autofix: none; nobody but the author knows the limits.
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

    Fix: exchange the two.

    Autofix: unsafe: the two values are exchanged, which is right unless one has a wrong sign.
    """
    for joint in context.sure_joints:
        limit = joint.limit
        low, high = joint.range
        if limit and joint.type in _LIMITED and low > high:
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

    Fix: give lower and upper, or make the joint `fixed`, or `continuous`.

    Autofix: none.
    """
    for joint in context.sure_joints:
        limit = joint.limit
        if not limit or joint.type not in _LIMITED or joint.mimic:
            continue
        low, high = joint.range
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
    """A movable joint whose effort or velocity limit is 0 or negative.

    Why: 0 is not "no limit". ros2_control, Gazebo and MoveIt take it at its word: a joint with 0 N m
    never accelerates, one with 0 rad/s may not turn, and a trajectory over it takes for ever.

    Example: `<limit lower="-1" upper="1" effort="0" velocity="0"/>`

    Fix: write what the motor can do: its stall torque in N m and its speed in rad/s (N and m/s for a
    prismatic joint).

    Autofix: none.
    """
    for joint in context.sure_joints:
        limit = joint.limit
        if not limit or not joint.has_position or joint.mimic:
            continue
        dead = [
            f"{name} {value:g} {unit}"
            for name, value, unit in (
                ("effort", limit.effort, "N" if joint.type is JointType.PRISMATIC else "N m"),
                ("velocity", limit.velocity, "m/s" if joint.type is JointType.PRISMATIC else "rad/s"),
            )
            if value is not None and value <= 0.0
        ]
        if dead:
            yield Finding(
                limit.origin,
                f"{joint.name}: {' and '.join(dead)} is no 'unlimited': a consumer that keeps to it never "
                "moves the joint",
                "write what the motor can do",
            )


@rule("J109", "limit-in-degrees", Severity.WARNING, "robot")
def limit_in_degrees(context: Context) -> Found:
    """A revolute joint that may turn more than two full turns either way: degrees for radians.

    Why: limits of -90..90 rad let the joint turn 14 times round; its stop does not exist, and a
    planner may go the long way.

    Example: `<limit lower="-90" upper="90" effort="10" velocity="1"/>`

    Fix: write radians; for a joint that may turn without end use `continuous`.

    Autofix: none.
    """
    for joint in context.sure_joints:
        limit = joint.limit
        if limit is None or joint.type is not JointType.REVOLUTE:
            continue
        worst = max(map(abs, joint.range))
        if 2.0 * _FULL_TURN < worst < 1e4:
            yield Finding(
                limit.origin,
                f"{joint.name}: {worst:g} rad is {worst / _FULL_TURN:.1f} turns: degrees where radians "
                "are meant?",
                f"as degrees it is {math.radians(worst):.4f} rad",
            )


@rule("J112", "limit-on-continuous", Severity.INFO, "robot")
def limit_on_continuous(context: Context) -> Found:
    """Position limits on a continuous joint.

    Why: urdfdom ignores lower and upper of a continuous joint: whoever wrote them expects a stop
    that is not there.

    Example: `<joint type="continuous"> … <limit lower="-1" upper="1" effort="5" velocity="2"/>`

    Fix: make the joint `revolute` to have the stop; else leave lower and upper out.

    Autofix: unsafe: lower and upper are removed.
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


@rule("J115", "zero-out-of-limits", Severity.INFO, "robot")
def zero_out_of_limits(context: Context) -> Found:
    """A joint whose limits leave 0 out.

    Why: at 0 is where joint_state_publisher, Gazebo and MoveIt put a joint that nobody has said
    anything about; this one starts outside its own limits, and is thrown to a stop or refused.

    Example: `<limit lower="0.5" upper="1.5" effort="10" velocity="1"/>`

    Fix: set the joint's frame so that 0 lies within, or give an initial position where the robot is
    started.

    Autofix: none.
    """
    for joint in context.sure_joints:
        limit = joint.limit
        if limit is None or joint.type not in _LIMITED or joint.mimic:
            continue
        low, high = joint.range
        if low <= high and not low - 1e-6 <= 0.0 <= high + 1e-6:
            yield Finding(
                limit.origin,
                f"{joint.name}: 0 lies outside {low:.4g}..{high:.4g} {_unit(joint)}, where every tool "
                "starts it",
            )
