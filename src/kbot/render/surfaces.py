"""The visible surfaces of links and bodies, as coloured triangles."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from types import MappingProxyType

import numpy as np
from numpy.typing import NDArray

from kbot.kinematics.transform import Transform
from kbot.model import Geometry, Link, Mesh, RobotModel
from kbot.model.meshes import MeshPart, Texture, load_mesh
from kbot.render.palette import UNPAINTED
from kbot.text import KbotError
from kbot.world import world as things
from kbot.world.ground import height_field_triangles, is_the_ground

AROUND = 48
"""Segments around a cylinder, a sphere or a capsule."""
MOST_TRIANGLES = 500_000
"""Limit for all visuals of a robot. This many in one STL take 1.0 GB and 6 s as PNG, 0.6 GB and 3 s as
GLB."""

Array = NDArray[np.float64]
RGBA = tuple[float, float, float, float]


@dataclass(frozen=True, slots=True)
class PaintedSurface:
    """Triangles of one colour in one frame: `vertices` (n, 3) in m, `faces` (m, 3) indices, `rgba` in
    0..1."""

    vertices: Array
    faces: NDArray[np.int64]
    rgba: RGBA
    texture: Texture | None = None

    def moved(self, pose: Transform) -> PaintedSurface:
        """Return the surface in the frame in which its own frame is at `pose`."""
        return PaintedSurface(pose.apply(self.vertices), self.faces, self.rgba, self.texture)


def robot_surfaces(
    robot: RobotModel, colours: Mapping[str, RGBA] = MappingProxyType({})
) -> Mapping[str, tuple[PaintedSurface, ...]]:
    """Return the visuals of each link in its own frame. Meshes that cannot be read are skipped.

    `colours` of links replace the description's own colours.

    Raises:
        KbotError: the visuals have more than MOST_TRIANGLES in all.
    """
    made: dict[str, tuple[PaintedSurface, ...]] = {}
    left = MOST_TRIANGLES
    for name, link in robot.links.items():
        surfaces = []
        for surface in _link_surfaces(link, colours.get(name)):
            left -= len(surface.faces)
            if left < 0:
                raise KbotError(
                    f"the visuals of the robot have more than {MOST_TRIANGLES} triangles."
                    f" The link '{name}' exceeds the limit. Simplify the meshes"
                )
            surfaces.append(surface)
        made[name] = tuple(surfaces)
    return made


def solid_surfaces(link: Link) -> tuple[PaintedSurface, ...]:
    """Return the collisions of a link in its own frame, for a robot whose visuals are missing."""
    return tuple(
        PaintedSurface(part.vertices, part.faces, UNPAINTED).moved(Transform.of(collision.pose))
        for collision in link.collisions
        for part in filter(_has_faces, parts(collision.geometry))
    )


def _link_surfaces(link: Link, colour: RGBA | None) -> Iterator[PaintedSurface]:
    for visual in link.visuals:
        pose = Transform.of(visual.pose)
        rgba = colour or (visual.material.rgba if visual.material else None)
        for part in filter(_has_faces, parts(visual.geometry)):
            own = rgba or part.rgba or UNPAINTED
            texture = None if rgba else part.texture
            yield PaintedSurface(part.vertices, part.faces, own, texture).moved(pose)


def body_surfaces(body: things.Body) -> Iterator[PaintedSurface]:
    """Yield the visible surfaces of a world's body, in its own frame, without level ground, which is the
    floor."""
    for part in body.parts:
        if part.visible and not is_the_ground(body, part):
            for mesh in filter(_has_faces, parts(part.shape)):
                yield PaintedSurface(mesh.vertices, mesh.faces, part.rgba).moved(part.pose)


def parts(shape: Geometry | things.Shape) -> tuple[MeshPart, ...]:
    """Return a shape's triangles. The parts of a mesh can have their own colours."""
    from trimesh import creation  # imported lazily: slow to import

    match shape:
        case things.Box(size=size):
            made = creation.box(size)
        case things.Cylinder(radius=radius, length=length):
            made = creation.cylinder(radius=radius, height=length, sections=AROUND)
        case things.Sphere(radius=radius):
            made = creation.uv_sphere(radius=radius, count=[AROUND // 2, AROUND])
        case things.Capsule(radius=radius, length=length):
            made = creation.capsule(height=length, radius=radius, count=[AROUND, AROUND // 2])
        case things.Ellipsoid(radii=radii):
            made = creation.uv_sphere(radius=1.0, count=[AROUND // 2, AROUND]).apply_scale(radii)
        case things.Plane(size=(x, y)):
            made = creation.box((x, y, 1e-4))
        case things.TriangleMesh(vertices=vertices, faces=faces):
            return (MeshPart(vertices, faces.astype(np.int64), None),)
        case things.HeightField():
            return (MeshPart(*height_field_triangles(shape), None),)
        case Mesh():
            return tuple(_scaled(part, shape.scale) for part in _mesh_parts(shape))
    return (MeshPart(np.asarray(made.vertices), np.asarray(made.faces, dtype=np.int64), None),)


def _has_faces(part: MeshPart) -> bool:
    """Return whether a part has faces. A shape without size has none."""
    return len(part.faces) > 0


def _mesh_parts(shape: Mesh) -> tuple[MeshPart, ...]:
    try:
        return load_mesh(shape.path).parts if shape.path is not None else ()
    except KbotError:
        return ()  # the checks report it at its line


def _scaled(part: MeshPart, scale: tuple[float, float, float]) -> MeshPart:
    mirrored = np.prod(scale) < 0.0
    faces = part.faces[:, ::-1] if mirrored else part.faces
    return MeshPart(part.vertices * np.asarray(scale), faces, part.rgba, part.texture)
