"""The links that bear a wheeled robot without driving it."""

from __future__ import annotations

from collections.abc import Iterable

from kbot.kinematics.frames import FrameTree
from kbot.kinematics.transform import Transform
from kbot.kinematics.wheels import pose_transform, rigid_links
from kbot.model import Box, Cylinder, Geometry, Link, Mesh
from kbot.model.shapes import span_along
from kbot.text import KbotError


def find_casters(
    tree: FrameTree, base: str, ground: float, radius: float, wheels: Iterable[str]
) -> tuple[str, ...]:
    """Links with a collision shape that ends near the ground, the driving wheels left out.

    `ground`: height of the contact plane in the base frame; `radius`: of the driving wheels; both in m.
    A ball or a wheel counts when it ends within half a drive wheel's radius of the plane, for that is
    what a caster of the wrong size looks like; another shape only when it touches.
    """
    robot = tree.robot
    driving = {part for link in wheels for part in rigid_links(robot, link)}
    return tuple(
        name
        for name, link in robot.links.items()
        if name not in driving and _bears(tree, link, base, ground, radius)
    )


def _bears(tree: FrameTree, link: Link, base: str, ground: float, radius: float) -> bool:
    base_from_link = tree.pose(link.name, in_frame=base)
    for collision in link.collisions:
        base_from_shape = base_from_link @ pose_transform(collision.pose)
        down = -base_from_shape.rotation[2]
        try:
            span = span_along(collision.geometry, down)
        except KbotError:
            continue
        if span is None:
            continue
        height = float(base_from_shape.translation[2]) - span[1] - ground
        reach = 0.5 if _rolls(collision.geometry, base_from_shape) else 0.05
        if abs(height) <= reach * radius:
            return True
    return False


def _rolls(shape: Geometry, base_from_shape: Transform) -> bool:
    """Whether it is a ball or a wheel rather than a foot."""
    if isinstance(shape, Cylinder):
        return abs(float(base_from_shape.rotation[2, 2])) < 0.5
    return not isinstance(shape, Box | Mesh)
