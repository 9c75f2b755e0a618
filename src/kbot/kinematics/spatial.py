"""Vectors, rotations and symmetric tensors of three dimensions as plain tuples.

For a single small matrix tuples are several times faster than arrays. `transform` and `frames` use arrays,
for many poses at once."""

from __future__ import annotations

import math
from functools import lru_cache
from typing import NamedTuple

from kbot.model import Pose

Vector = tuple[float, float, float]
Matrix = tuple[Vector, Vector, Vector]
Quaternion = tuple[float, float, float, float]
"""A unit quaternion x, y, z, w."""

IDENTITY: Matrix = ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0))
ZERO: Vector = (0.0, 0.0, 0.0)
GRAVITY = 9.81
"""m/s^2, if the world does not define it."""


def add(a: Vector, b: Vector) -> Vector:
    return (a[0] + b[0], a[1] + b[1], a[2] + b[2])


def subtract(a: Vector, b: Vector) -> Vector:
    return (a[0] - b[0], a[1] - b[1], a[2] - b[2])


def scale(a: Vector, by: float) -> Vector:
    return (a[0] * by, a[1] * by, a[2] * by)


def dot(a: Vector, b: Vector) -> float:
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


def cross(a: Vector, b: Vector) -> Vector:
    return (a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0])


def norm(a: Vector) -> float:
    return math.hypot(*a)


def unit(a: Vector) -> Vector | None:
    """The unit vector along a vector; None for a vector of length zero."""
    length = norm(a)
    return scale(a, 1.0 / length) if length > 1e-12 and math.isfinite(length) else None


def rotate(m: Matrix, v: Vector) -> Vector:
    return (dot(m[0], v), dot(m[1], v), dot(m[2], v))


def transpose(m: Matrix) -> Matrix:
    a, b, c = m
    return ((a[0], b[0], c[0]), (a[1], b[1], c[1]), (a[2], b[2], c[2]))


def multiply(m: Matrix, n: Matrix) -> Matrix:
    if m is IDENTITY:
        return n
    if n is IDENTITY:
        return m
    columns = transpose(n)
    a, b, c = ((dot(row, columns[0]), dot(row, columns[1]), dot(row, columns[2])) for row in m)
    return (a, b, c)


@lru_cache(maxsize=4096)
def rotation(rpy: Vector) -> Matrix:
    """The rotation by roll, then pitch, then yaw in radians about the fixed x, y, z axes (REP 103, URDF)."""
    if rpy == ZERO:
        return IDENTITY
    roll, pitch, yaw = (angle + 0.0 for angle in rpy)  # -0.0 and 0.0 share an entry of the cache
    cr, sr = math.cos(roll), math.sin(roll)
    cp, sp = math.cos(pitch), math.sin(pitch)
    cy, sy = math.cos(yaw), math.sin(yaw)
    return (
        (cy * cp, cy * sp * sr - sy * cr, cy * sp * cr + sy * sr),
        (sy * cp, sy * sp * sr + cy * cr, sy * sp * cr - cy * sr),
        (-sp, cp * sr, cp * cr),
    )


def quaternion_product(a: Quaternion, b: Quaternion) -> Quaternion:
    """The rotation `b`, then `a` (Hamilton product), with w >= 0."""
    ax, ay, az, aw = a
    bx, by, bz, bw = b
    x = aw * bx + ax * bw + ay * bz - az * by
    y = aw * by - ax * bz + ay * bw + az * bx
    z = aw * bz + ax * by - ay * bx + az * bw
    w = aw * bw - ax * bx - ay * by - az * bz
    return (x, y, z, w) if w >= 0.0 else (-x, -y, -z, -w)


class SpatialFrame(NamedTuple):
    """The pose of an inner frame in an outer frame."""

    rotation: Matrix = IDENTITY
    translation: Vector = ZERO

    @classmethod
    def of(cls, pose: Pose) -> SpatialFrame:
        """The frame of an `<origin>`."""
        return cls(rotation(pose.rpy), pose.xyz)

    def then(self, inner: SpatialFrame) -> SpatialFrame:
        """outer_from_inmost = outer_from_inner.then(inner_from_inmost)."""
        return SpatialFrame(multiply(self.rotation, inner.rotation), self.point(inner.translation))

    def point(self, p: Vector) -> Vector:
        """A point from the inner frame to the outer frame."""
        return add(p if self.rotation is IDENTITY else rotate(self.rotation, p), self.translation)

    def direction(self, d: Vector) -> Vector:
        return rotate(self.rotation, d)

    def local(self, p: Vector) -> Vector:
        """A point from the outer frame to the inner frame."""
        return rotate(transpose(self.rotation), subtract(p, self.translation))

    def local_direction(self, d: Vector) -> Vector:
        return rotate(transpose(self.rotation), d)


def tensor_in(rotation_: Matrix, tensor: Matrix) -> Matrix:
    """A tensor from the inner axes to the outer axes: R T R^T."""
    if rotation_ is IDENTITY:
        return tensor
    return multiply(multiply(rotation_, tensor), transpose(rotation_))


def diagonal(d: Vector) -> Matrix:
    return ((d[0], 0.0, 0.0), (0.0, d[1], 0.0), (0.0, 0.0, d[2]))


def steiner(mass: float, offset: Vector) -> Matrix:
    """The tensor of a point mass at `offset` (parallel axis theorem)."""
    x, y, z = offset
    return (
        (mass * (y * y + z * z), -mass * x * y, -mass * x * z),
        (-mass * x * y, mass * (x * x + z * z), -mass * y * z),
        (-mass * x * z, -mass * y * z, mass * (x * x + y * y)),
    )


def add_matrix(m: Matrix, n: Matrix) -> Matrix:
    return (add(m[0], n[0]), add(m[1], n[1]), add(m[2], n[2]))


def scale_matrix(m: Matrix, by: float) -> Matrix:
    return (scale(m[0], by), scale(m[1], by), scale(m[2], by))


@lru_cache(maxsize=4096)
def eigenvalues(m: Matrix) -> Vector:
    """Eigenvalues of a symmetric matrix, smallest first, in closed form (Smith 1961).

    The results are cached because many rules need those of the same tensor.
    """
    (a, d, e), (_, b, f), (_, _, c) = m
    off = d * d + e * e + f * f
    if off == 0.0:
        low, middle, high = sorted((a, b, c))
        return (low, middle, high)
    largest = max(abs(v) for row in m for v in row)
    if not 1e-100 < largest < 1e100:  # products of such numbers overflow or underflow
        low, middle, high = eigenvalues(scale_matrix(m, 1.0 / largest)) if math.isfinite(largest) else m[0]
        return (low * largest, middle * largest, high * largest)
    mean = (a + b + c) / 3.0
    x, y, z = a - mean, b - mean, c - mean
    p = math.sqrt((x * x + y * y + z * z + 2.0 * off) / 6.0)
    n = (
        ((a - mean) / p, d / p, e / p),
        (d / p, (b - mean) / p, f / p),
        (e / p, f / p, (c - mean) / p),
    )
    half = dot(n[0], cross(n[1], n[2])) / 2.0
    angle = math.acos(min(1.0, max(-1.0, half))) / 3.0
    high = mean + 2.0 * p * math.cos(angle)
    low = mean + 2.0 * p * math.cos(angle + 2.0 * math.pi / 3.0)
    return (low, 3.0 * mean - high - low, high)
