"""The world's bodies as the page draws them."""

from __future__ import annotations

from collections.abc import Iterator

from kbot.workbench.meshes.store import MeshStore
from kbot.workbench.protocol import BodyView, Shape, ShapeKind
from kbot.workbench.source.places import place
from kbot.world.ground import height_field_triangles, is_the_ground
from kbot.world.world import (
    Body,
    Box,
    Capsule,
    Cylinder,
    Ellipsoid,
    HeightField,
    Plane,
    Sphere,
    TriangleMesh,
    World,
)


def world_view(world: World, meshes: MeshStore) -> tuple[BodyView, ...]:
    """Return every body that has something to draw or that moves. The poses in states are in this order.

    Level ground at z = 0 is skipped, because it is the page's own grid.
    """
    bodies = (_body(body, meshes) for body in world.bodies)
    return tuple(body for body in bodies if body.parts or body.moving)


def _body(body: Body, meshes: MeshStore) -> BodyView:
    return BodyView(
        name=body.name,
        moving=not body.is_static,
        parts=tuple(_parts(body, meshes)),
        position=tuple(body.pose.translation.tolist()),
        quaternion=body.pose.quaternion_xyzw,
    )


def _parts(body: Body, meshes: MeshStore) -> Iterator[Shape]:
    for part in body.parts:
        if not part.visible:
            continue
        shape, mesh = part.shape, ""
        kind: ShapeKind
        size: tuple[float, ...]
        match shape:
            case Plane():
                if is_the_ground(body, part):
                    continue
                kind, size = "box", (*shape.size, 1e-4)
            case Box() | Cylinder() | Sphere() | Capsule():
                kind, size = kind_and_size(shape)
            case Ellipsoid(radii=size):
                kind = "ellipsoid"
            case TriangleMesh(vertices=vertices, faces=faces):
                kind, size, mesh = "mesh", (1.0, 1.0, 1.0), meshes.add_triangles(vertices, faces)
            case HeightField():
                kind, size, mesh = (
                    "mesh",
                    (1.0, 1.0, 1.0),
                    meshes.add_triangles(*height_field_triangles(shape)),
                )
        yield Shape(
            kind,
            size,
            tuple(part.pose.translation.tolist()),
            part.pose.quaternion_xyzw,
            part.rgba,
            mesh,
            place(part.origin),
        )


def kind_and_size(shape: Box | Cylinder | Sphere | Capsule) -> tuple[ShapeKind, tuple[float, ...]]:
    """Return the page's name of a shape, of a world or of a robot, and its dimensions in m."""
    match shape:
        case Box(size=size):
            return "box", size
        case Cylinder(radius=radius, length=length):
            return "cylinder", (radius, length)
        case Capsule(radius=radius, length=length):
            return "capsule", (radius, length)
        case Sphere(radius=radius):
            return "sphere", (radius,)
