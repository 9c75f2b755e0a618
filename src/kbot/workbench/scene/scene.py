"""Build the scene that the page draws, from robot and world."""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Mapping
from typing import Literal, TypeAlias

import numpy as np

from kbot.kinematics.bodies import principal_axes
from kbot.kinematics.transform import Transform, quaternion_xyzw_from_rotation
from kbot.model import (
    Box,
    Capsule,
    Collision,
    Cylinder,
    Inertial,
    Joint,
    JointType,
    Link,
    Mesh,
    RobotModel,
    Sphere,
    Visual,
)
from kbot.render.bounds import visible_bounds
from kbot.render.palette import UNPAINTED
from kbot.text import KbotError
from kbot.workbench.meshes.store import MeshStore
from kbot.workbench.protocol import BodyView, InertiaView, JointView, LinkView, Scene, Shape, ShapeKind
from kbot.workbench.scene.world_view import kind_and_size, world_view
from kbot.workbench.source.places import place
from kbot.world.sdf.materials import link_colours
from kbot.world.world import Rgba, World

Control: TypeAlias = Literal["none", "position", "velocity"]

USUAL_SPEED = 10.0
"""Speed in rad/s or m/s of a joint without a velocity limit."""
OWN_COLOURS = (-1.0, -1.0, -1.0, -1.0)
"""Marks a mesh that has the colours of its file."""


NO_ROBOT_BOUNDS = np.array([-0.2, -0.2, 0.0]), np.array([0.2, 0.2, 0.2])
"""What the camera frames while there is no robot: the space that a small robot needs, in m."""


def build_scene(
    robot: RobotModel,
    world: World | None,
    meshes: MeshStore,
    revision: int,
    *,
    frame: str,
    on_ground: bool,
    controls: Mapping[str, Control],
    others: Mapping[str, RobotModel],
) -> Scene:
    """Build the scene of a robot, alone on a floor under its lowest point, or `on_ground` in a world.

    A robot without links means that there is no robot yet.

    `frame` is the frame of the poses in states. `controls` are the commands that joints accept. `others` are
    the robots besides the one on display, by name. With a world, links have the colours that Gazebo gives
    them. Without one, they have those of rviz.
    """
    low, high = visible_bounds(robot) if robot.links else NO_ROBOT_BOUNDS
    colours = link_colours(robot) if world is not None else {}
    return Scene(
        revision=revision,
        robot=robot.name,
        root=robot.root if robot.links else "",
        world=frame,
        links=tuple(_link(robot, link, meshes, colours.get(name)) for name, link in robot.links.items()),
        joints=tuple(_joint(joint, controls.get(joint.name, "none")) for joint in robot.movable_joints),
        bodies=all_bodies(world, others, meshes),
        ground=0.0 if on_ground else min(0.0, float(low[2])),
        radius=max(0.02, float(np.linalg.norm(high - low)) / 2),
        centre=tuple(((low + high) / 2).tolist()),
    )


def all_bodies(
    world: World | None, others: Mapping[str, RobotModel], meshes: MeshStore
) -> tuple[BodyView, ...]:
    """Return the world's bodies, then each link of the robots besides the one on display, as `name/link`."""
    links = (
        _other_link(f"{name}/{link.name}", link, link_colours(robot).get(link.name), meshes)
        for name, robot in others.items()
        for link in robot.links.values()
    )
    return (*(world_view(world, meshes) if world else ()), *links)


def _other_link(name: str, link: Link, painted: Rgba | None, meshes: MeshStore) -> BodyView:
    return BodyView(
        name, True, tuple(_shapes(link.visuals, meshes, painted)), (0.0, 0.0, 0.0), (0.0, 0.0, 0.0, 1.0)
    )


def _link(robot: RobotModel, link: Link, meshes: MeshStore, painted: Rgba | None) -> LinkView:
    joint = robot.parent_joint.get(link.name)
    return LinkView(
        name=link.name,
        parent=joint.parent if joint else "",
        joint=joint.name if joint else "",
        visuals=tuple(_shapes(link.visuals, meshes, painted)),
        collisions=tuple(_shapes(link.collisions, meshes)),
        inertia=_inertia(link.inertial) if link.inertial else None,
        place=place(link.origin),
    )


def _shapes(
    parts: Iterable[Visual | Collision], meshes: MeshStore, painted: Rgba | None = None
) -> Iterator[Shape]:
    """Yield the shapes of parts. `painted` is a colour that replaces the parts' own."""
    for part in parts:
        material = part.material if isinstance(part, Visual) else None
        rgba = painted or (material.rgba if material and material.rgba else UNPAINTED)
        shape = part.geometry
        mesh = ""
        kind: ShapeKind
        size: tuple[float, ...]
        match shape:
            case Box() | Cylinder() | Sphere() | Capsule():
                kind, size = kind_and_size(shape)
            case Mesh(path=None):
                continue
            case Mesh(path=path, scale=scale):
                try:
                    mesh = meshes.add_file(path or "")
                except KbotError:
                    continue  # the checks report it at its line
                kind, size = "mesh", scale
                if not (painted or (material and material.rgba)):
                    rgba = OWN_COLOURS
        position, quaternion = position_quaternion(Transform.of(part.pose))
        yield Shape(kind, size, position, quaternion, rgba, mesh, place(part.origin))


def position_quaternion(pose: Transform) -> tuple[tuple[float, ...], tuple[float, ...]]:
    """Return translation (3,) and quaternion x, y, z, w as plain floats."""
    return tuple(pose.translation.tolist()), pose.quaternion_xyzw


def _inertia(inertial: Inertial) -> InertiaView | None:
    """Return the box of uniform density with the same mass and principal moments, or None without a mass.

    A box has I_x = m (y^2 + z^2) / 12 and so on, so x^2 = 6 (I_y + I_z - I_x) / m. The moments of a real body
    obey the triangle inequality, which keeps the squares positive.
    """
    if not inertial.mass > 0.0 or not np.isfinite(inertial.tensor).all():
        return None
    moments, axes = principal_axes(inertial.tensor)
    squares = 6.0 * (moments.sum() - 2.0 * moments) / inertial.mass
    pose = Transform.of(inertial.pose)
    turned = Transform.from_quaternion_xyzw(quaternion_xyzw_from_rotation(axes))
    position, quaternion = position_quaternion(pose @ turned)
    box = tuple(math.sqrt(max(0.0, float(square))) for square in squares)
    return InertiaView(inertial.mass, box, position, quaternion, place(inertial.origin))


def _joint(joint: Joint, control: Control) -> JointView:
    lower, upper = slider_range(joint)
    speed = joint.limit.velocity if joint.limit is not None else None
    return JointView(
        name=joint.name,
        kind=joint.type.value,  # type: ignore[arg-type]  # a movable joint is of one of the three kinds
        child=joint.child,
        axis=tuple(joint.axis),
        lower=lower,
        upper=upper,
        mimics=joint.mimic.joint if joint.mimic else "",
        control=control,
        speed=speed or USUAL_SPEED,
        place=place(joint.origin),
    )


def slider_range(joint: Joint) -> tuple[float, float]:
    """Return the range of a joint's slider: its limits, otherwise half a turn or a metre each way."""
    reach = 1.0 if joint.type is JointType.PRISMATIC else math.pi
    lower, upper = joint.range
    return (lower, upper) if lower < upper < math.inf else (-reach, reach)
