"""Converts SDF geometries to shapes: sizes, meshes and height maps."""

from __future__ import annotations

from collections.abc import Callable
from functools import lru_cache
from math import inf

import numpy as np

from kbot.kinematics.transform import Transform
from kbot.model.meshes import MeshData, load_mesh
from kbot.text import Element, KbotError
from kbot.world.images import read_picture
from kbot.world.sdf.values import SdfValues
from kbot.world.world import (
    FURTHEST,
    Box,
    Capsule,
    Cylinder,
    Ellipsoid,
    HeightField,
    Plane,
    Shape,
    Sphere,
    TriangleMesh,
)

Placed = tuple[Shape, Transform]
FindFile = Callable[[Element], str | None]
CONE_SIDES = 32
"""Faces of the side of a cone's mesh."""
MOST_HEIGHTS = 17_000_000
"""Most samples of a height map: 4097 by 4097, which needs 0.8 GB in a simulation."""
SHAPES = ("box", "sphere", "cylinder", "capsule", "ellipsoid", "cone", "plane", "mesh", "heightmap")


class Shapes:
    """Converts `<geometry>` to shapes. `find_file` returns the file of a `<uri>`."""

    def __init__(self, values: SdfValues, find_file: FindFile) -> None:
        self._values, self._find_file = values, find_file

    def read(self, geometry: Element | None, parent: Element) -> list[Placed]:
        """The shapes of a `<geometry>`, each with its pose in the visual or collision.

        If it cannot be built, the list is empty and a finding is reported.
        """
        shape = next(geometry.elements(), None) if geometry is not None else None
        if shape is None:
            self._values.findings.warning(
                "W205", f"<{parent.tag}> has no <geometry>", parent.origin, "KBot ignores it"
            )
            return []
        if shape.tag == "empty":
            return []
        make = getattr(self, f"_{shape.tag}", None) if shape.tag in SHAPES else None
        if make is None:
            self._values.unsupported(shape, f"the shape <{shape.tag}> is not simulated")
            return []
        try:
            placed: list[Placed] = make(shape)
        except KbotError as error:
            self._values.fault("W206", str(error), shape.origin, "leaves the shape out")
            return []
        return placed

    def _numbers(self, shape: Element, tag: str, count: int = 1) -> tuple[float, ...] | None:
        element = shape.find(tag)
        if element is not None:
            return self._values.sizes(element, shape, tag, count)
        default = 0.5 if tag == "radius" and shape.tag in ("capsule", "cone") else 1.0
        message = f"<{shape.tag}> has no <{tag}>: KBot uses {default:g} m, the default of SDF"
        self._values.findings.warning("W205", message, shape.origin, f"add <{tag}>")
        return (default,) * count

    def _file(self, shape: Element) -> str | None:
        uri = shape.find("uri") or shape.find("filename")
        if uri is None:
            message = f"<{shape.tag}> has no <uri>"
            self._values.fault("W205", message, shape.origin, "leaves the shape out")
            return None
        return self._find_file(uri)

    def _box(self, shape: Element) -> list[Placed]:
        size = self._numbers(shape, "size", 3)
        return [(Box((size[0], size[1], size[2])), Transform.identity())] if size else []

    def _sphere(self, shape: Element) -> list[Placed]:
        radius = self._numbers(shape, "radius")
        return [(Sphere(radius[0]), Transform.identity())] if radius else []

    def _cylinder(self, shape: Element) -> list[Placed]:
        radius, length = self._numbers(shape, "radius"), self._numbers(shape, "length")
        return [(Cylinder(radius[0], length[0]), Transform.identity())] if radius and length else []

    def _capsule(self, shape: Element) -> list[Placed]:
        radius, length = self._numbers(shape, "radius"), self._numbers(shape, "length")
        return [(Capsule(radius[0], length[0]), Transform.identity())] if radius and length else []

    def _ellipsoid(self, shape: Element) -> list[Placed]:
        radii = self._numbers(shape, "radii", 3)
        return [(Ellipsoid((radii[0], radii[1], radii[2])), Transform.identity())] if radii else []

    def _cone(self, shape: Element) -> list[Placed]:
        radius, length = self._numbers(shape, "radius"), self._numbers(shape, "length")
        if not (radius and length):
            return []
        angles = np.linspace(0.0, 2.0 * np.pi, CONE_SIDES, endpoint=False)
        rim = np.column_stack([np.cos(angles), np.sin(angles)]) * radius[0]
        low = np.full((CONE_SIDES, 1), -length[0] / 2)
        vertices = np.vstack([np.hstack([rim, low]), [[0, 0, length[0] / 2], [0, 0, -length[0] / 2]]])
        at = np.arange(CONE_SIDES)
        after = (at + 1) % CONE_SIDES
        side = np.column_stack([at, after, np.full(CONE_SIDES, CONE_SIDES)])
        bottom = np.column_stack([after, at, np.full(CONE_SIDES, CONE_SIDES + 1)])
        faces = np.vstack([side, bottom]).astype(np.int32)
        return [(TriangleMesh(vertices, faces), Transform.identity())]

    def _plane(self, shape: Element) -> list[Placed]:
        written = shape.find("size")
        uses = f"draws {Plane().size[0]:g} m of the plane"
        size = self._values.sizes(written, shape, "size", 2, inf, uses) if written is not None else None
        plane = Plane((size[0], size[1])) if size else Plane()
        normal = shape.find("normal")
        values = self._values.numbers(normal, 3, FURTHEST, "uses 0 0 1") if normal is not None else None
        return [(plane, _turned_to(np.array(values)) if values and any(values) else Transform.identity())]

    def _mesh(self, shape: Element) -> list[Placed]:
        path = self._file(shape)
        if path is None:
            return []
        written = shape.find("scale")
        uses = "uses 1 1 1"
        found = self._values.numbers(written, 3, FURTHEST, uses) if written is not None else None
        scale = found or (1.0, 1.0, 1.0)
        if shape.find("submesh") is not None:
            self._values.unsupported(shape, "<submesh> is not supported: KBot uses the whole mesh")
        return [(_scaled(load_mesh(path), scale), Transform.identity())]

    def _heightmap(self, shape: Element) -> list[Placed]:
        path, size = self._file(shape), self._numbers(shape, "size", 3)
        if path is None or size is None:
            return []
        grey, _ = read_picture(path, MOST_HEIGHTS)
        where = shape.find("pos")
        uses = "uses 0 0 0"
        found = self._values.numbers(where, 3, FURTHEST, uses) if where is not None else None
        place = found or (0.0, 0.0, 0.0)
        # the image's first row is the far side, +y
        field = HeightField(np.flipud(grey).astype(np.float64) * size[2], (size[0], size[1]))
        return [(field, Transform.from_xyz_rpy(place, (0.0, 0.0, 0.0)))]


@lru_cache(maxsize=64)
def _scaled(data: MeshData, scale: tuple[float, ...]) -> TriangleMesh:
    """Scale a mesh. Equal arguments return the same object, so that it is split into convex pieces once."""
    return TriangleMesh(data.vertices * np.array(scale), data.faces.astype(np.int32))


def _turned_to(normal: np.ndarray) -> Transform:
    """The smallest rotation that turns z to a direction."""
    z = normal / np.abs(normal).max()  # the squares of tiny numbers are zero
    z /= np.linalg.norm(z)
    if z[2] < -1.0 + 1e-12:
        return Transform.from_xyz_rpy((0.0, 0.0, 0.0), (np.pi, 0.0, 0.0))
    x, y = -z[1], z[0]
    return Transform.from_quaternion_xyzw((x, y, 0.0, 1.0 + float(z[2])))
