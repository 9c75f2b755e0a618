"""Where a joint has its child link, in plain numbers: for what is asked of few joints many times a second."""

from __future__ import annotations

from math import cos, sin

from kbot.kinematics.frames import unit_axis
from kbot.kinematics.transform import Transform
from kbot.model import Joint, JointType

Translation = tuple[float, float, float]
"""Metres."""
Rotation = tuple[float, float, float, float]
"""A unit quaternion x, y, z, w with w >= 0."""


class JointPose:
    """`parent_from_child` of one joint."""

    def __init__(self, joint: Joint) -> None:
        parent_from_joint = Transform.of(joint.pose)
        x, y, z = parent_from_joint.translation.tolist()
        axis = unit_axis(joint)
        self._translation: Translation = (x, y, z)
        self._rotation = parent_from_joint.quaternion_xyzw
        self._axis = axis.tolist()
        self._slide = (parent_from_joint.rotation @ axis).tolist()
        self._is_slide = joint.type is JointType.PRISMATIC
        self._stays = not any(self._axis)

    def at(self, position: float) -> tuple[Translation, Rotation]:
        """For a position in rad or m; a joint without one stands at 0."""
        if self._stays or not position:
            return self._translation, self._rotation
        if self._is_slide:
            (x, y, z), (dx, dy, dz) = self._translation, self._slide
            return (x + position * dx, y + position * dy, z + position * dz), self._rotation
        c, s = cos(position / 2.0), sin(position / 2.0)
        x, y, z = self._axis
        return self._translation, product(self._rotation, (x * s, y * s, z * s, c))


def product(a: Rotation, b: Rotation) -> Rotation:
    """The rotation `b`, then `a`: the product of quaternions (Hamilton)."""
    ax, ay, az, aw = a
    bx, by, bz, bw = b
    x = aw * bx + ax * bw + ay * bz - az * by
    y = aw * by - ax * bz + ay * bw + az * bx
    z = aw * bz + ax * by - ay * bx + az * bw
    w = aw * bw - ax * bx - ay * by - az * bz
    return (x, y, z, w) if w >= 0.0 else (-x, -y, -z, -w)
