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
_UNLIMITED = 1e4
"""rad. A limit from this size on is written to mean that the joint has none, and not in degrees."""


def _unit(joint: Joint) -> str:
    return "m" if joint.type is JointType.PRISMATIC else "rad"


@rule("J101", "missing-limit", Severity.ERROR, "robot", is_ros_only=True)
def missing_limit(context: Context) -> Found:
    """A revolute or prismatic joint has no `<limit>`.

    Why: urdfdom refuses the whole robot: "joint is of type REVOLUTE but it does not specify limits". Every
    tool that uses urdfdom then loads nothing.

    Example: `<joint name="arm" type="revolute"> <axis xyz="0 0 1"/> … </joint>`

    Fix: Add `<limit lower="-1.57" upper="1.57" effort="10" velocity="1"/>`, or make the joint `continuous` if
    it can turn without a stop.

    Autofix: none. Only the author knows the limits.
    """
    for joint in context.sure_joints:
        if joint.type in _LIMITED and joint.limit is None:
            hint = 'add <limit lower="…" upper="…" effort="…" velocity="…"/>'
            if joint.type is JointType.REVOLUTE:
                hint += ', or use type="continuous" for a joint without stops'
            yield Finding(joint.origin, f"{joint.name}: a {joint.type} joint needs a <limit>", hint)


@rule("J102", "limit-reversed", Severity.ERROR, "robot")
def limit_reversed(context: Context) -> Found:
    """The lower limit of a joint is above its upper limit.

    Why: No position satisfies both limits. Simulators clamp the joint to one end, refuse it, or make it jump
    from one stop to the other. MoveIt rejects every state of the robot.

    Example: `<limit lower="1.57" upper="-1.57" effort="10" velocity="1"/>`

    Fix: Swap the two values.

    Autofix: unsafe: KBot swaps the two values. This is wrong if one value has a wrong sign.
    """
    for joint in context.sure_joints:
        limit = joint.limit
        low, high = joint.range
        if limit and joint.type in _LIMITED and low > high:
            yield Finding(
                limit.origin,
                f"{joint.name}: the lower limit {low:.6g} {_unit(joint)} is above the upper one "
                f"{high:.6g} {_unit(joint)}: no position is allowed",
                "swap lower and upper",
                fix=context.exchange(limit.origin, "lower", "upper"),
            )


@rule("J103", "limit-closed", Severity.WARNING, "robot")
def limit_closed(context: Context) -> Found:
    """The lower and upper limits of a movable joint are equal.

    Why: Tools publish, plan for and simulate the joint as movable, but it never moves. A solver spends its
    iterations on a stop that is hit from both sides. `<limit effort=… velocity=…/>` alone means lower = upper
    = 0.

    Example: `<joint type="revolute"> … <limit effort="10" velocity="1"/> </joint>`

    Fix: Set lower and upper, or make the joint `fixed` or `continuous`.

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
    """The effort or velocity limit of a movable joint is 0 or negative.

    Why: 0 does not mean "no limit", and a negative number does so only in Gazebo Classic. ros2_control,
    Gazebo and MoveIt apply it: a joint with 0 N m never accelerates, and one with 0 rad/s cannot turn. A
    trajectory for such a joint takes infinitely long.

    Example: `<limit lower="-1" upper="1" effort="0" velocity="0"/>`

    Fix: Write the motor's stall torque in N m and its speed in rad/s (N and m/s for a prismatic joint).

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
            is_negative = min(limit.effort or 0.0, limit.velocity or 0.0) < 0.0
            means = (
                "means 'unlimited' only in Gazebo Classic: another tool that applies it"
                if is_negative
                else "does not mean 'unlimited': a tool that applies it"
            )
            yield Finding(
                limit.origin,
                f"{joint.name}: a limit of {' and '.join(dead)} {means} never moves the joint",
                "write the limits of the motor",
            )


@rule("J109", "limit-in-degrees", Severity.WARNING, "robot")
def limit_in_degrees(context: Context) -> Found:
    """A limit of a revolute joint is beyond two full turns, probably because it is in degrees.

    Why: URDF angles are in radians. Limits of -90..90 rad let the joint turn 14 times in each direction. The
    joint has no usable stop, and a planner may choose a long way round.

    Example: `<limit lower="-90" upper="90" effort="10" velocity="1"/>`

    Fix: Write radians. Use type `continuous` for a joint that can turn without a stop.

    Autofix: none.
    """
    for joint in context.sure_joints:
        limit = joint.limit
        if limit is None or joint.type is not JointType.REVOLUTE:
            continue
        worst = max(map(abs, joint.range))
        if 2.0 * _FULL_TURN < worst < _UNLIMITED:
            yield Finding(
                limit.origin,
                f"{joint.name}: {worst:g} rad is {worst / _FULL_TURN:.1f} turns: is it in degrees instead of "
                "radians?",
                f"if it is in degrees, write {math.radians(worst):.4f}",
            )


@rule("J112", "limit-on-continuous", Severity.INFO, "robot")
def limit_on_continuous(context: Context) -> Found:
    """A continuous joint has position limits.

    Why: urdfdom ignores lower and upper of a continuous joint. The stop that they describe does not exist.

    Example: `<joint type="continuous"> … <limit lower="-1" upper="1" effort="5" velocity="2"/>`

    Fix: Make the joint `revolute` to have the stop, or remove lower and upper.

    Autofix: unsafe: KBot removes lower and upper.
    """
    for joint in context.sure_joints:
        limit = joint.limit
        if limit is None or joint.type is not JointType.CONTINUOUS:
            continue
        low, high = limit.lower or 0.0, limit.upper or 0.0
        if (low, high) != (0.0, 0.0) and max(abs(low), abs(high)) < _UNLIMITED:
            yield Finding(
                limit.origin,
                f"{joint.name}: a continuous joint has no stops; {low:.4g}..{high:.4g} rad is ignored",
                'use type="revolute" to have stops, or remove lower and upper',
                fix=remove_attributes(context.element_at(limit.origin), ("lower", "upper"), safe=False),
            )


@rule("J115", "zero-out-of-limits", Severity.INFO, "robot")
def zero_out_of_limits(context: Context) -> Found:
    """0 is outside the limits of a joint.

    Why: joint_state_publisher, Gazebo and MoveIt start a joint at 0 if they have no other position. The joint
    then starts outside its limits. Simulators snap the joint to a limit, and planners reject the start state.

    Example: `<limit lower="0.5" upper="1.5" effort="10" velocity="1"/>`

    Fix: Choose the joint's frame so that 0 is within the limits, or set an initial position in the launch
    file.

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
                f"{joint.name}: tools start the joint at 0, which is outside its limits "
                f"{low:.4g}..{high:.4g} {_unit(joint)}",
            )
