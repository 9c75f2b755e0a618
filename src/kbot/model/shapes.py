"""Computes the extent of shapes: bounding boxes, and spans along a direction.

Coordinates are in the shape's own frame. Its origin is the centre, or for a mesh the origin of its file.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike, NDArray

from kbot.model.geometry import Box, Capsule, Cylinder, Geometry, Mesh, Sphere
from kbot.model.meshes import load_mesh

Array = NDArray[np.float64]


def span_along(shape: Geometry, direction: Sequence[float] | Array) -> tuple[float, float] | None:
    """The extent of a shape along `direction` (a unit vector): the lowest and highest coordinate in m.

    None for a mesh without a file.

    Raises:
        KbotError: a mesh file cannot be read.
    """
    x, y, z = (abs(float(v)) for v in direction)
    match shape:
        case Box(size=(a, b, c)):
            reach = (a * x + b * y + c * z) / 2
        case Sphere(radius=r):
            reach = r
        case Cylinder(radius=r, length=h):
            reach = r * math.hypot(x, y) + h * z / 2
        case Capsule(radius=r, length=h):
            reach = r + h * z / 2
        case Mesh(path=None):
            return None
        case Mesh():
            along = vertices(shape) @ np.asarray(direction, dtype=np.float64)
            return float(along.min()), float(along.max())
    return -reach, reach


def bounds(shape: Geometry, rotation: ArrayLike | None = None) -> tuple[Array, Array] | None:
    """The lowest and highest corner (3,) of the bounding box of a shape, rotated by `rotation` (3, 3).

    None as for `span_along`.
    """
    axes = np.eye(3) if rotation is None else np.asarray(rotation, dtype=np.float64)
    spans = [span_along(shape, axis) for axis in axes]
    known = [span for span in spans if span is not None]
    if len(known) < 3:
        return None
    return np.array([low for low, _ in known]), np.array([high for _, high in known])


def vertices(mesh: Mesh) -> Array:
    """The scaled vertices (n, 3) of a mesh in metres. The mesh must have a file.

    Raises:
        KbotError: the mesh file cannot be read.
    """
    scaled: Array = load_mesh(mesh.path or mesh.uri).vertices * np.asarray(mesh.scale)
    return scaled
