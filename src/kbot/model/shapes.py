"""What a shape measures: volume, inertia as a solid body, how far it reaches.

A shape's numbers are in its own frame, whose origin is its centre (a mesh's: where its file has it).
Formulas: solid bodies of constant density, as in any table of moments of inertia.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from kbot.model.geometry import Box, Capsule, Cylinder, Geometry, Mesh, Sphere
from kbot.model.link import Inertial
from kbot.model.meshes import load_mesh

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Solid:
    """A shape filled at density 1: volume in m^3, centre of mass (3,) in m, tensor (3, 3) in m^5 about it."""

    volume: float
    center: Array
    inertia: Array


def solid(shape: Geometry) -> Solid | None:
    """The shape as a solid body; None for a mesh that has no file or is not closed.

    Raises:
        KbotError: a mesh file cannot be read.
    """
    match shape:
        case Box(size=(x, y, z)):
            volume = x * y * z
            moments = (y * y + z * z) / 12, (x * x + z * z) / 12, (x * x + y * y) / 12
        case Sphere(radius=r):
            volume = 4 / 3 * math.pi * r**3
            moments = (2 / 5 * r * r,) * 3
        case Cylinder(radius=r, length=h):
            volume = math.pi * r * r * h
            across = (3 * r * r + h * h) / 12
            moments = across, across, r * r / 2
        case Capsule(radius=r, length=h):
            volume, moments = _capsule(r, h)
        case Mesh():
            return _solid_mesh(shape)
    return Solid(volume, np.zeros(3), volume * np.diag(moments))


def solid_inertia(shape: Geometry, mass: float) -> Array | None:
    """Tensor (3, 3) in kg m^2 about the centre of mass, of a solid body of `mass` kg; None as for `solid`."""
    body = solid(shape)
    if body is None or not body.volume > 0.0:
        return None
    return body.inertia * (mass / body.volume)


def volume(shape: Geometry) -> float | None:
    """In m^3; None as for `solid`."""
    body = solid(shape)
    return None if body is None else body.volume


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


def bounding_radius(shape: Geometry, about: ArrayLike = (0.0, 0.0, 0.0)) -> float | None:
    """How far the shape's farthest point is from the point `about` (3,), in m; None as for `span_along`."""
    point = np.abs(np.asarray(about, dtype=np.float64))
    match shape:
        case Box(size=size):
            return float(np.linalg.norm(point + np.asarray(size) / 2))
        case Sphere(radius=r):
            return float(np.linalg.norm(point)) + r
        case Cylinder(radius=r, length=h):
            return math.hypot(float(np.hypot(point[0], point[1])) + r, float(point[2]) + h / 2)
        case Capsule(radius=r, length=h):
            return float(np.linalg.norm(point + np.array([0.0, 0.0, h / 2]))) + r
        case Mesh(path=None):
            return None
        case Mesh():
            away = vertices(shape) - np.asarray(about, dtype=np.float64)
            return float(np.sqrt((away * away).sum(axis=1).max()))


def vertices(mesh: Mesh) -> Array:
    """A mesh's vertices (n, 3) in metres, its scale applied; it must have a file.

    Raises:
        KbotError: the mesh file cannot be read.
    """
    scaled: Array = load_mesh(mesh.path or mesh.uri).vertices * np.asarray(mesh.scale)
    return scaled


def tensor(inertial: Inertial) -> Array:
    """The tensor (3, 3) of an inertial, in the axes of its pose."""
    i = inertial
    return np.array([[i.ixx, i.ixy, i.ixz], [i.ixy, i.iyy, i.iyz], [i.ixz, i.iyz, i.izz]])


def _capsule(r: float, h: float) -> tuple[float, tuple[float, float, float]]:
    """Volume, and moments per volume: a cylinder and two half spheres, each moved out by h/2 + 3r/8."""
    tube, ball = math.pi * r * r * h, 4 / 3 * math.pi * r**3
    whole = tube + ball
    if not whole > 0.0:
        return whole, (0.0, 0.0, 0.0)
    along = tube * r * r / 2 + ball * 2 / 5 * r * r
    half_about_own_center = (2 / 5 - 9 / 64) * r * r
    across = tube * (3 * r * r + h * h) / 12 + ball * (half_about_own_center + (h / 2 + 3 * r / 8) ** 2)
    return whole, (across / whole, across / whole, along / whole)


def _solid_mesh(mesh: Mesh) -> Solid | None:
    if mesh.path is None:
        return None
    unscaled = load_mesh(mesh.path).solid
    if not unscaled.is_closed:
        return None
    scale = np.asarray(mesh.scale)
    grow = abs(float(np.prod(scale)))
    # second moments about the centre scale by pairs of axes; the tensor is trace(c) I - c
    moments = np.eye(3) * np.trace(unscaled.inertia) / 2 - unscaled.inertia
    scaled = moments * np.outer(scale, scale) * grow
    inertia = np.eye(3) * np.trace(scaled) - scaled
    return Solid(unscaled.volume * grow, unscaled.center * scale, inertia)
