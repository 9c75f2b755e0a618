"""Converts URDF joints to joints of the engine: range, damping, friction and mimics."""

from __future__ import annotations

from collections.abc import Collection

import mujoco
import numpy as np

from kbot.kinematics.frames import joint_transform, unit_axis
from kbot.kinematics.transform import Transform
from kbot.model import Joint, JointType, RobotModel
from kbot.sim.engine.world_joints import set_friction, stiffen
from kbot.text import DiagnosticCollector

_HINGE = mujoco.mjtJoint.mjJNT_HINGE
_SLIDE = mujoco.mjtJoint.mjJNT_SLIDE
_BALL = mujoco.mjtJoint.mjJNT_BALL


def add_joint(body: mujoco.MjsBody, joint: Joint, prefix: str, findings: DiagnosticCollector) -> None:
    """Add a body's joint.

    A planar joint becomes two slides across its axis and a hinge about it, a floating joint three slides and
    a ball. The engine's names of these are `joint:x`, `joint:y` and so on.
    """
    name = prefix + joint.name
    if joint.type is JointType.FIXED:
        return
    if joint.type is JointType.FLOATING:
        for index, letter in enumerate("xyz"):
            body.add_joint(name=f"{name}:{letter}", type=_SLIDE, axis=np.eye(3)[index])
        body.add_joint(name=f"{name}:ball", type=_BALL)
        return
    axis = unit_axis(joint)
    if not axis.any():
        findings.error(
            "W105", f"the axis of joint '{joint.name}' is zero", joint.axis_origin or joint.origin,
            "give <axis> a direction, for example xyz=\"0 0 1\"",
        )  # fmt: skip
        return
    if joint.type is JointType.PLANAR:
        first = np.cross(axis, np.eye(3)[int(np.abs(axis).argmin())])
        second = np.cross(axis, first)
        body.add_joint(name=f"{name}:x", type=_SLIDE, axis=first)
        body.add_joint(name=f"{name}:y", type=_SLIDE, axis=second)
        body.add_joint(name=f"{name}:yaw", type=_HINGE, axis=axis)
        return
    kind = _SLIDE if joint.type is JointType.PRISMATIC else _HINGE
    added = body.add_joint(name=name, type=kind, axis=axis)
    if joint.dynamics is not None:
        damping, friction = resistance(joint)
        added.damping[0] = damping
        set_friction(added, friction)
    _limit(added, joint, findings)


def _limit(added: mujoco.MjsJoint, joint: Joint, findings: DiagnosticCollector) -> None:
    if joint.type is JointType.CONTINUOUS or joint.limit is None:
        return
    lower, upper = joint.range
    if lower > upper:
        findings.error(
            "W109", f"joint '{joint.name}' has its lower limit {lower:g} above its upper limit {upper:g}",
            joint.limit.origin, "swap the limits",
        )  # fmt: skip
        return
    added.limited = True
    # the engine needs a range: a joint with equal limits (often both left at 0) moves by 1e-6
    added.range = (lower, upper) if lower < upper else (lower - 1e-6, upper + 1e-6)


def resistance(joint: Joint) -> tuple[float, float]:
    """The damping of a joint in N m s/rad or N s/m, and its dry friction in N m or N. Below 0 they are 0."""
    dynamics = joint.dynamics
    return (0.0, 0.0) if dynamics is None else (max(dynamics.damping, 0.0), max(dynamics.friction, 0.0))


def rest(joint: Joint) -> float:
    """The start position of a joint in rad or m: 0, or the limit that is nearest to 0."""
    lower, upper = joint.range
    return min(max(0.0, lower), upper) if lower <= upper else 0.0


def held_pose(joint: Joint) -> Transform:
    """`parent_from_child` of a joint that is held at its start position."""
    if not joint.has_position:
        return Transform.of(joint.pose)
    return joint_transform(joint, rest(joint))


def add_mimics(
    spec: mujoco.MjSpec,
    robot: RobotModel,
    held: frozenset[str],
    driven: Collection[str],
    prefix: str,
    findings: DiagnosticCollector,
) -> None:
    """Couple each mimic joint to the joint that it follows.

    Joints that are `held` do not follow, nor do those that are `driven`: the drive commands each by itself.
    """
    for joint in robot.joints.values():
        if joint.mimic is None or not joint.has_position:
            continue
        leader = robot.joints.get(joint.mimic.joint)
        if leader is None or not leader.has_position or leader is joint:
            findings.error(
                "W108",
                f"joint '{joint.name}' mimics '{joint.mimic.joint}', which is not a movable joint",
                joint.mimic.origin,
            )
            continue
        if joint.name in held or joint.name in driven:
            continue
        offset, multiplier = joint.mimic.offset, joint.mimic.multiplier
        equality = spec.add_equality(type=mujoco.mjtEq.mjEQ_JOINT, name1=prefix + joint.name)
        if leader.name in held:
            equality.data[:5] = (offset + multiplier * rest(leader), 0.0, 0.0, 0.0, 0.0)
        else:
            equality.name2 = prefix + leader.name
            equality.data[:5] = (offset, multiplier, 0.0, 0.0, 0.0)
        stiffen(equality)
