"""Computes size, volume and inertia tensor of a link's shapes."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

from kbot.checks.facts.mesh_files import mesh_facts, mesh_volume
from kbot.kinematics.spatial import (
    IDENTITY,
    Matrix,
    SpatialFrame,
    Vector,
    add_matrix,
    diagonal,
    rotation,
    scale_matrix,
    steiner,
    subtract,
    tensor_in,
    transpose,
)
from kbot.model import Box, Capsule, Collision, Cylinder, Geometry, Inertial, Link, Mesh, Sphere, Visual
from kbot.text import Origin


def link_tensor(inertial: Inertial) -> Matrix:
    """The tensor about the centre of mass, in the link's axes, kg m^2."""
    return tensor_in(rotation(inertial.pose.rpy), inertial.tensor)


@dataclass(frozen=True, slots=True)
class LinkShape:
    """One shape of a link, in the link's frame. A mesh is represented by its bounding box.

    `half` are the half extents along the shape's own axes, m.
    """

    geometry: Geometry
    frame: SpatialFrame
    half: Vector
    origin: Origin

    @property
    def volume(self) -> float | None:
        """The volume in m^3. None for a mesh that is not closed, or too large to compute it."""
        match self.geometry:
            case Box(size=(x, y, z)):
                return x * y * z
            case Cylinder(radius=r, length=length):
                return math.pi * r * r * length
            case Sphere(radius=r):
                return 4.0 / 3.0 * math.pi * r * r * r
            case Capsule(radius=r, length=length):
                return math.pi * r * r * (length + 4.0 / 3.0 * r)
            case Mesh(path=path, scale=(x, y, z)):
                volume = mesh_volume(path) if path else None
                return volume * abs(x * y * z) if volume else None

    def support(self, direction: Vector) -> float:
        """Extent of the shape from its centre along a unit direction of the link's frame, m."""
        x, y, z = direction if self.frame.rotation is IDENTITY else self.frame.local_direction(direction)
        match self.geometry:
            case Sphere(radius=r):
                return r
            case Cylinder(radius=r, length=length):
                return r * math.hypot(x, y) + length / 2.0 * abs(z)
            case Capsule(radius=r, length=length):
                return r + length / 2.0 * abs(z)
            case _:
                return abs(x) * self.half[0] + abs(y) * self.half[1] + abs(z) * self.half[2]

    def reach(self, point: Vector) -> float:
        """Distance from a point of the link's frame to the shape's farthest point, m."""
        x, y, z = self.frame.local(point)
        match self.geometry:
            case Sphere(radius=r):
                return math.hypot(x, y, z) + r
            case Cylinder(radius=r, length=length):
                return math.hypot(math.hypot(x, y) + r, abs(z) + length / 2.0)
            case Capsule(radius=r, length=length):
                return math.hypot(x, y, abs(z) + length / 2.0) + r
            case _:
                a, b, c = self.half
                return math.hypot(abs(x) + a, abs(y) + b, abs(z) + c)

    def solid_diagonal(self) -> Vector:
        """Principal moments per kg of a solid of this shape, in its own axes, m^2."""
        match self.geometry:
            case Sphere(radius=r):
                moment = 0.4 * r * r
                return (moment, moment, moment)
            case Cylinder(radius=r, length=length):
                across = (3.0 * r * r + length * length) / 12.0
                return (across, across, r * r / 2.0)
            case Capsule(radius=r, length=length):
                return _capsule_moments(r, length)
            case _:
                a, b, c = (2.0 * h for h in self.half)
                return ((b * b + c * c) / 12.0, (a * a + c * c) / 12.0, (a * a + b * b) / 12.0)


@dataclass(frozen=True, slots=True)
class Solid:
    """Volume (m^3), centre (m) and tensor per kg about it (m^2) of shapes with uniform density."""

    volume: float
    center: Vector
    unit_tensor: Matrix
    parts: tuple[LinkShape, ...]


@dataclass(frozen=True)
class LinkBody:
    """A link's shapes, and the solid that its mass and inertia are compared with."""

    visuals: tuple[LinkShape, ...]
    collisions: tuple[LinkShape, ...]
    complete: bool
    """Whether every shape is known: no mesh is missing."""

    @cached_property
    def parts(self) -> tuple[LinkShape, ...]:
        return (*self.visuals, *self.collisions)

    def reach(self, point: Vector) -> float:
        """Distance from a point of the link's frame to the farthest point of any shape, m."""
        return max((part.reach(point) for part in self.parts), default=0.0)

    @cached_property
    def ends(self) -> tuple[Vector, Vector] | None:
        """Lowest and highest coordinates of all shapes in the link's frame."""
        return bounds(self.parts)

    @cached_property
    def solid(self) -> Solid | None:
        """The solid of the collisions, or of the visuals if there are none. None if a volume is not known."""
        return solid(self.collisions) if self.collisions else solid(self.visuals)


def body_of(link: Link) -> LinkBody:
    visuals = [_part(v) for v in link.visuals]
    collisions = [_part(c) for c in link.collisions]
    return LinkBody(
        tuple(p for p in visuals if p),
        tuple(p for p in collisions if p),
        None not in visuals and None not in collisions,
    )


def bounds(parts: Sequence[LinkShape], frame: SpatialFrame | None = None) -> tuple[Vector, Vector] | None:
    """Lowest and highest coordinates of parts, in the link's frame or, given its pose, in an outer frame."""
    if not parts:
        return None
    axes = transpose(frame.rotation) if frame else IDENTITY
    low, high = [math.inf] * 3, [-math.inf] * 3
    for part in parts:
        center = frame.point(part.frame.translation) if frame else part.frame.translation
        for i in range(3):
            reach = part.support((axes[0][i], axes[1][i], axes[2][i]))
            low[i] = min(low[i], center[i] - reach)
            high[i] = max(high[i], center[i] + reach)
    return (low[0], low[1], low[2]), (high[0], high[1], high[2])


def solid(parts: Sequence[LinkShape]) -> Solid | None:
    """The solid of shapes with uniform density. None without shapes or if a volume is not known.

    Overlaps count twice.
    """
    volume, moment, kept = 0.0, [0.0, 0.0, 0.0], []
    for part in parts:
        own_volume = part.volume
        if own_volume is None or not own_volume > 0.0:
            return None
        volume += own_volume
        kept.append((part, own_volume))
        for i in range(3):
            moment[i] += own_volume * part.frame.translation[i]
    if not kept:
        return None
    center = (moment[0] / volume, moment[1] / volume, moment[2] / volume)
    tensor: Matrix = diagonal((0.0, 0.0, 0.0))
    for part, own_volume in kept:
        share = own_volume / volume
        own = scale_matrix(tensor_in(part.frame.rotation, diagonal(part.solid_diagonal())), share)
        tensor = add_matrix(tensor, own)
        tensor = add_matrix(tensor, steiner(share, subtract(part.frame.translation, center)))
    return Solid(volume, center, tensor, tuple(parts))


def _part(shape: Visual | Collision) -> LinkShape | None:
    """The shape in the link's frame. None for a mesh that cannot be read or a size that is not positive."""
    geometry, frame = shape.geometry, SpatialFrame.of(shape.pose)
    match geometry:
        case Box(size=size):
            half = (size[0] / 2.0, size[1] / 2.0, size[2] / 2.0)
        case Cylinder(radius=r, length=length):
            half = (r, r, length / 2.0)
        case Sphere(radius=r):
            half = (r, r, r)
        case Capsule(radius=r, length=length):
            half = (r, r, length / 2.0 + r)
        case Mesh():
            return _mesh_part(geometry, frame)
    return LinkShape(geometry, frame, half, geometry.origin) if min(half) > 0.0 else None


def _mesh_part(mesh: Mesh, frame: SpatialFrame) -> LinkShape | None:
    facts = mesh_facts(mesh.path) if mesh.path else None
    if facts is None:
        return None
    ends = [sorted((low * s, high * s)) for low, high, s in zip(*facts.bounds, mesh.scale, strict=True)]
    x, y, z = ((low + high) / 2.0 for low, high in ends)
    a, b, c = ((high - low) / 2.0 for low, high in ends)
    placed = SpatialFrame(frame.rotation, frame.point((x, y, z)))
    return LinkShape(mesh, placed, (a, b, c), mesh.origin)


def _capsule_moments(r: float, length: float) -> Vector:
    """Principal moments per kg of a cylinder with two half spheres, of uniform density."""
    cylinder, ball = math.pi * r * r * length, 4.0 / 3.0 * math.pi * r * r * r
    total = cylinder + ball
    along = (cylinder * r * r / 2.0 + ball * 0.4 * r * r) / total
    across = (
        cylinder * (3.0 * r * r + length * length) / 12.0
        + ball * (0.4 * r * r + length * length / 4.0 + 0.375 * length * r)
    ) / total
    return (across, across, along)


def lowest(part: LinkShape, frame: SpatialFrame) -> float:
    """Height of a part's lowest point in the root's frame, m. `frame` is the pose of its link."""
    down = frame.local_direction((0.0, 0.0, -1.0))
    return frame.point(part.frame.translation)[2] - part.support(down)


def axis_of(part: LinkShape) -> Vector | None:
    """The symmetry axis of a cylinder or capsule in the link's frame; None for other shapes."""
    if isinstance(part.geometry, Cylinder | Capsule):
        return part.frame.direction((0.0, 0.0, 1.0))
    return None
