"""What a robot measures and weighs as a whole, as it stands."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from kbot.kinematics.frames import FrameTree
from kbot.kinematics.transform import Transform
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


def total_mass(tree: FrameTree) -> float:
    """The mass of all links, in kg."""
    return sum(link.inertial.mass for link in tree.robot.links.values() if link.inertial)


def center_of_mass(
    tree: FrameTree, in_frame: str | None = None, joints: Mapping[str, float] | None = None
) -> Array | None:
    """The centre of mass (3,) in m, in a link's frame (the root's by default); None where nothing weighs."""
    moment, mass = np.zeros(3), 0.0
    for name, root_from_link in tree.poses(joints).items():
        inertial = tree.robot.links[name].inertial
        if inertial is not None:
            moment += inertial.mass * root_from_link.apply(inertial.pose.xyz)
            mass += inertial.mass
    if not mass > 0.0:
        return None
    return tree.pose(in_frame or tree.root, joints=joints).inverse().apply(moment / mass)
