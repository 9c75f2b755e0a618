"""How far along a ray a plain shape is hit."""

from __future__ import annotations

import math

from kbot.kinematics.spatial import Vector, dot
from kbot.model import Box, Capsule, Cylinder, Sphere


def distance_along(p: Vector, d: Vector, shape: object, half: Vector) -> float | None:
    """Distance along a ray to a plain shape at the origin; None when it misses or starts within."""
    match shape:
        case Sphere(radius=r):
            return _ball(p, d, r)
        case Box():
            return _slab(p, d, half)
        case Cylinder(radius=r, length=length) | Capsule(radius=r, length=length):
            return _tube(p, d, r, length / 2.0)
    return None


def _ball(p: Vector, d: Vector, r: float) -> float | None:
    b, c = dot(p, d), dot(p, p) - r * r
    inner = b * b - c
    return -b - math.sqrt(inner) if c > 0.0 and inner > 0.0 and -b > 0.0 else None


def _slab(p: Vector, d: Vector, half: Vector) -> float | None:
    enter, leave = 0.0, math.inf
    for x, v, h in zip(p, d, half, strict=True):
        if abs(v) < 1e-12:
            if abs(x) >= h:
                return None
            continue
        a, b = sorted(((-h - x) / v, (h - x) / v))
        enter, leave = max(enter, a), min(leave, b)
    return enter if 0.0 < enter < leave else None


def _tube(p: Vector, d: Vector, r: float, half: float) -> float | None:
    a = d[0] * d[0] + d[1] * d[1]
    c = p[0] * p[0] + p[1] * p[1] - r * r
    if a < 1e-12:
        return None
    b = p[0] * d[0] + p[1] * d[1]
    inner = b * b - a * c
    if inner <= 0.0 or (c < 0.0 and abs(p[2]) < half):
        return None
    t = (-b - math.sqrt(inner)) / a
    return t if t > 0.0 and abs(p[2] + t * d[2]) < half else None
