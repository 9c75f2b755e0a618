"""The extent of a shape: bounding boxes, and spans along a direction.

A shape's numbers are in its own frame, whose origin is its centre (a mesh's: where its file has it).
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
    """The least and greatest of `direction` (a unit vector) times p over the shape's points p, in m.

    None for a mesh that has no file.

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
    """Lowest and highest corner (3,) of the upright box about the shape, in axes that see it turned by
    `rotation` (3, 3); None as for `span_along`."""
    axes = np.eye(3) if rotation is None else np.asarray(rotation, dtype=np.float64)
    spans = [span_along(shape, axis) for axis in axes]
    known = [span for span in spans if span is not None]
    if len(known) < 3:
        return None
    return np.array([low for low, _ in known]), np.array([high for _, high in known])


def vertices(mesh: Mesh) -> Array:
    """A mesh's vertices (n, 3) in metres, its scale applied; it must have a file.

    Raises:
        KbotError: the mesh file cannot be read.
    """
    scaled: Array = load_mesh(mesh.path or mesh.uri).vertices * np.asarray(mesh.scale)
    return scaled
