"""What a robot measures and weighs as a whole, as it stands."""

from __future__ import annotations

from collections.abc import Iterator, Mapping

import numpy as np
from numpy.typing import NDArray

from kbot.kinematics.frames import FrameTree
from kbot.kinematics.transform import Transform
from kbot.model import Inertial, Robot
from kbot.model.shapes import bounds
from kbot.text import KbotError

Array = NDArray[np.float64]


def robot_bounds(
    tree: FrameTree, in_frame: str | None = None, joints: Mapping[str, float] | None = None
) -> tuple[Array, Array] | None:
    """Lowest and highest corner (3,) in m of the upright box about all that is seen or touched, in the axes
    of a link (the root by default); meshes whose file is missing or broken are left out. None where
    nothing has a size."""
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


def total_mass(robot: Robot) -> float:
    """Mass of all links in kg; a mass that is not positive and finite counts as 0."""
    return sum(inertial.mass for _, inertial in _with_mass(robot))


def center_of_mass(
    tree: FrameTree, in_frame: str | None = None, joints: Mapping[str, float] | None = None
) -> Array | None:
    """Centre of mass (3,) in m, in the frame of a link (the root's by default).

    The masses are those of `total_mass`; None if it is 0.
    """
    moment, mass = np.zeros(3), 0.0
    poses = tree.poses(joints)
    for name, inertial in _with_mass(tree.robot):
        moment += inertial.mass * poses[name].apply(inertial.pose.xyz)
        mass += inertial.mass
    if mass == 0.0:
        return None
    return tree.pose(in_frame or tree.root, joints=joints).inverse().apply(moment / mass)


def _with_mass(robot: Robot) -> Iterator[tuple[str, Inertial]]:
    for name, link in robot.links.items():
        if link.inertial is not None and 0.0 < link.inertial.mass < np.inf:
            yield name, link.inertial
