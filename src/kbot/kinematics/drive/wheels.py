"""Finds the wheels and casters of a robot by its joints and shapes, not by names."""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from kbot.kinematics.frames import FrameTree, unit_axis
from kbot.kinematics.transform import Transform
from kbot.model import (
    Box,
    Capsule,
    Cylinder,
    Geometry,
    Joint,
    JointType,
    Link,
    Mesh,
    Pose,
    RobotModel,
    Sphere,
)
from kbot.model.shapes import span_along
from kbot.text import KbotError

Array = NDArray[np.float64]

_PARALLEL = math.cos(math.radians(5.0))
_ROUND = 0.03
"""By how much of its radius a mesh's outline may differ between directions and still be round."""


@dataclass(frozen=True, slots=True)
class Wheel:
    """A round body on a level axle; `center` (3,) and the unit `axis` (3,) in the base frame, in m."""

    joint: str
    link: str
    radius: float
    width: float
    center: Array
    axis: Array
    shape: Geometry


@dataclass(frozen=True, slots=True)
class NoWheel:
    """A joint that might have held a wheel, and why it does not."""

    joint: str
    reason: str


def rigid_links(robot: RobotModel, link: str) -> Iterator[str]:
    """`link` and the links that fixed joints hold to it from below."""
    waiting = [link]
    while waiting:
        name = waiting.pop()
        yield name
        waiting.extend(j.child for j in robot.child_joints[name] if j.type is JointType.FIXED)


def movable_above(robot: RobotModel, link: str) -> Joint | None:
    """The nearest joint above a link that moves by a motor or a spring; None where the link hangs rigidly on
    the root, or on a body that floats."""
    while link != robot.root:
        above = robot.parent_joint[link]
        if above.is_movable:
            return above if above.has_position else None
        link = above.parent
    return None


def carrier(robot: RobotModel, link: str) -> str:
    """The topmost link above `link` that goes with it over the ground: the root, or a body that floats."""
    while link != robot.root:
        above = robot.parent_joint[link]
        if above.is_movable and not above.has_position:
            return link
        link = above.parent
    return link


def find_wheel(tree: FrameTree, joint: Joint, base: str) -> Wheel | NoWheel:
    """The wheel on a joint that turns; its size is that of the largest round shape about the axle."""
    robot = tree.robot
    base_from_wheel = tree.pose(joint.child, in_frame=base)
    axis = base_from_wheel.rotation @ unit_axis(joint)
    if abs(axis[2]) > 0.2:
        return NoWheel(joint.name, "its axis is not level")
    best: Wheel | None = None
    unknown = ""
    for link in rigid_links(robot, joint.child):
        base_from_link = tree.pose(link, in_frame=base)
        for pose, shape in _shapes(robot.links[link]):
            base_from_shape = base_from_link @ Transform.of(pose)
            size = _round_about(shape, base_from_shape.rotation.T @ axis)
            if isinstance(size, str):
                unknown = unknown or size
                continue
            radius, width, middle = size
            center = base_from_shape.apply(middle)
            away = center - base_from_wheel.translation
            off_axle = float(np.linalg.norm(away - axis * (away @ axis)))
            if off_axle > 0.05 * radius:
                unknown = unknown or "its shape is not centred on its axis"
            elif best is None or radius > best.radius:
                best = Wheel(joint.name, joint.child, radius, width, center, axis, shape)
    return best or NoWheel(joint.name, unknown or "it turns no shape")


def _shapes(link: Link) -> list[tuple[Pose, Geometry]]:
    """What the link touches the ground with; what is seen of it where nothing plain is said to touch."""
    collisions: list[tuple[Pose, Geometry]] = [(c.pose, c.geometry) for c in link.collisions]
    visuals: list[tuple[Pose, Geometry]] = [(v.pose, v.geometry) for v in link.visuals]
    for shapes in (collisions, visuals):
        plain = [item for item in shapes if isinstance(item[1], Cylinder | Sphere | Capsule)]
        if plain:
            return plain
    return collisions or visuals


def _round_about(shape: Geometry, axis: Array) -> tuple[float, float, Array] | str:
    """Radius, width and middle (3,) of a shape that is round about `axis`, or why it is not.

    `axis` (3,) and the middle are in the shape's frame.
    """
    match shape:
        case Sphere(radius=radius) if radius > 0.0:
            return radius, 2.0 * radius, np.zeros(3)
        case Cylinder(radius=radius, length=length) if radius > 0.0:
            if abs(axis[2]) < _PARALLEL:
                return "its cylinder does not lie along its axis"
            return radius, length, np.zeros(3)
        case Capsule(radius=radius, length=length) if radius > 0.0:
            if abs(axis[2]) < _PARALLEL:
                return "its capsule does not lie along its axis"
            return radius, length + 2.0 * radius, np.zeros(3)
        case Mesh():
            return _round_mesh(shape, axis)
    return "its shape is not round"


def _round_mesh(mesh: Mesh, axis: Array) -> tuple[float, float, Array] | str:
    if mesh.path is None:
        return f"its size is not known, for its mesh is not found: {mesh.uri}"
    helper = np.eye(3)[int(np.argmin(np.abs(axis)))]
    across = np.cross(axis, helper)
    across /= np.linalg.norm(across)
    up = np.cross(axis, across)
    try:
        spans = [
            span_along(mesh, direction) for direction in (axis, across, up, (across + up) / math.sqrt(2))
        ]
    except KbotError as error:
        return str(error)
    (low, high), *outline = [span for span in spans if span is not None]
    diameters = [b - a for a, b in outline]
    radius = max(diameters) / 2.0
    if radius <= 0.0 or max(diameters) - min(diameters) > _ROUND * 2.0 * radius:
        return "its mesh is not round"
    middle = axis * (low + high) / 2.0
    for direction, (a, b) in zip((across, up), outline[:2], strict=True):
        middle = middle + direction * (a + b) / 2.0
    return radius, high - low, middle


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
        base_from_shape = base_from_link @ Transform.of(collision.pose)
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
