"""Size, mass and inertia of a robot as a whole and of bodies that move as one."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from kbot.kinematics.frames import FrameTree
from kbot.kinematics.transform import Transform
from kbot.model import Inertial, RobotModel
from kbot.model.shapes import bounds
from kbot.text import KbotError

Array = NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class MassProperties:
    """`mass` in kg, `center` of mass (3,) in m, and `tensor` (3, 3) about it in kg m^2, in one frame."""

    mass: float
    center: Array
    tensor: Array

    def in_frame(self, outer_from_inner: Transform) -> MassProperties:
        """The same body in an outer frame."""
        turn = outer_from_inner.rotation
        return MassProperties(self.mass, outer_from_inner.apply(self.center), turn @ self.tensor @ turn.T)

    @classmethod
    def combined(cls, bodies: Sequence[MassProperties]) -> MassProperties:
        """Bodies that move as one, all in the same frame (parallel axis theorem)."""
        total = sum(body.mass for body in bodies)
        center: Array = sum((body.mass * body.center for body in bodies), np.zeros(3)) / total
        tensor = np.zeros((3, 3))
        for body in bodies:
            away = body.center - center
            tensor += body.tensor + body.mass * (away @ away * np.eye(3) - np.outer(away, away))
        return cls(total, center, tensor)


def principal_axes(tensor: ArrayLike) -> tuple[Array, Array]:
    """Principal moments (3,) of a symmetric tensor (3, 3), smallest first, and the rotation (3, 3) whose
    columns are their axes."""
    moments, axes = np.linalg.eigh(np.asarray(tensor, dtype=np.float64))
    if np.linalg.det(axes) < 0.0:
        axes[:, 0] *= -1.0
    return moments, axes


THINNEST = 1e-2
"""Thickness of a repaired body, as a share of its length: a body without thickness has a moment of 0."""


def possible_moments(moments: ArrayLike) -> Array | None:
    """The principal moments (3,) of the nearest possible body. None if no moment is above 0.

    A body's second moments of mass along its principal axes, (I2 + I3 - I1) / 2 and so on, are sums of
    squares, so they are not negative (Wensing, Kim, Slotine, "Linear Matrix Inequalities for Physically
    Consistent Inertial Parameter Identification", 2018). Negative ones become 0, which gives the nearest such
    matrix in the Frobenius norm (Higham, "Computing a nearest symmetric positive semidefinite matrix", 1988).
    If a moment is not above 0, or only by rounding, the body also gets a thickness.
    """
    given = np.asarray(moments, dtype=np.float64)
    second = given.sum() / 2.0 - given
    if given.max() <= 0.0 or second.max() <= 0.0:
        return None
    # a little more than 0: rounding must not make the sum of two moments less than the third
    second = np.maximum(second, 1e-9 * second.max())
    if given.min() <= 1e-12 * given.max():
        second = np.maximum(second, THINNEST**2 * second.max())
    possible: Array = second.sum() - second
    return possible


def robot_bounds(
    tree: FrameTree, in_frame: str | None = None, joints: Mapping[str, float] | None = None
) -> tuple[Array, Array] | None:
    """Lowest and highest corner (3,) in m of the box around all visuals and collisions, along the axes of a
    link (the root by default). Meshes whose file is missing or broken are left out. None if nothing has a
    size."""
    frame = in_frame or tree.root
    frame_from_root = tree.pose(frame, joints=joints).inverse()
    corners: list[tuple[Array, Array]] = []
    for name, root_from_link in tree.poses(joints).items():
        link = tree.robot.links[name]
        for part in link.shapes:
            frame_from_shape = frame_from_root @ root_from_link @ Transform.of(part.pose)
            try:
                box = bounds(part.geometry, frame_from_shape.rotation)
            except KbotError:
                continue
            if box is not None:
                corners.append((box[0] + frame_from_shape.translation, box[1] + frame_from_shape.translation))
    if not corners:
        return None
    return np.min([low for low, _ in corners], axis=0), np.max([high for _, high in corners], axis=0)


def total_mass(robot: RobotModel) -> float:
    """Mass of all links in kg; a mass that is not positive and finite counts as 0."""
    return sum(inertial.mass for _, inertial in with_mass(robot))


def center_of_mass(
    tree: FrameTree, in_frame: str | None = None, joints: Mapping[str, float] | None = None
) -> Array | None:
    """Centre of mass (3,) in m, in the frame of a link (the root's by default).

    The masses are those of `total_mass`; None if it is 0.
    """
    moment, mass = np.zeros(3), 0.0
    poses = tree.poses(joints)
    for name, inertial in with_mass(tree.robot):
        moment += inertial.mass * poses[name].apply(inertial.pose.xyz)
        mass += inertial.mass
    if mass == 0.0:
        return None
    return tree.pose(in_frame or tree.root, joints=joints).inverse().apply(moment / mass)


def with_mass(robot: RobotModel) -> Iterator[tuple[str, Inertial]]:
    """The names and inertials of the links whose mass is positive and finite."""
    for name, link in robot.links.items():
        if link.inertial is not None and 0.0 < link.inertial.mass < np.inf:
            yield name, link.inertial
