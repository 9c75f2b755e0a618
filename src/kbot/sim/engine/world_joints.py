"""Builds the joints of a world's bodies in the engine's model."""

from __future__ import annotations

from math import isfinite

import mujoco

from kbot.sim.recipe import SOLIMP, SOLREF
from kbot.world.body_joints import BodyJoint, Freedom, JointMotion

_TYPES = {
    JointMotion.TURN: mujoco.mjtJoint.mjJNT_HINGE,
    JointMotion.SLIDE: mujoco.mjtJoint.mjJNT_SLIDE,
    JointMotion.BALL: mujoco.mjtJoint.mjJNT_BALL,
}
_SHUT = 1e-6
"""rad or m by which a joint with equal limits can move: the engine needs a range."""


def add_world_joint(spec: mujoco.MjSpec, body: mujoco.MjsBody, owner: str, joint: BodyJoint) -> None:
    """Add a joint to an engine's body. `owner` is the name of the world's body."""
    names = [f"/{owner}~{index}" for index in range(len(joint.freedoms))]
    for name, freedom in zip(names, joint.freedoms, strict=True):
        _add(body, name, freedom, joint.anchor)
    if joint.lead is not None:
        turn, slide = names
        nut = spec.add_equality(type=mujoco.mjtEq.mjEQ_JOINT, name1=slide, name2=turn)
        nut.data[:5] = (0.0, joint.lead, 0.0, 0.0, 0.0)
        stiffen(nut)


def stiffen(equality: mujoco.MjsEquality) -> None:
    """Make an equality constraint as stiff as the default time step allows.

    MuJoCo recommends a time constant of at least two steps.
    """
    equality.solref = (0.004, 1.0)
    equality.solimp = (0.99, 0.999, 0.001, 0.5, 2.0)


def set_friction(joint: mujoco.MjsJoint, friction: float) -> None:
    """Set dry friction in N m or N, as stiff as contacts.

    It creeps by micrometres. With MuJoCo's default softness it would creep by centimetres.
    """
    joint.frictionloss = friction
    joint.solref_friction = SOLREF
    joint.solimp_friction = SOLIMP


def _add(body: mujoco.MjsBody, name: str, freedom: Freedom, anchor: tuple[float, float, float]) -> None:
    added = body.add_joint(name=name, type=_TYPES[freedom.motion], pos=anchor)
    if freedom.motion is not JointMotion.BALL:
        added.axis = freedom.axis
    added.damping[0] = freedom.damping
    set_friction(added, freedom.friction)
    if freedom.stiffness:
        added.stiffness[0] = freedom.stiffness
        added.springref = freedom.spring_reference
    if isfinite(freedom.lower) or isfinite(freedom.upper):
        lower, upper = max(freedom.lower, -1e10), min(freedom.upper, 1e10)
        added.limited = True
        added.range = (lower, upper) if lower < upper else (lower - _SHUT, upper + _SHUT)
