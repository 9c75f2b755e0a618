"""Computes the outline of a solid shape between two heights, seen from above."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from kbot.kinematics.planar import convex_hull
from kbot.kinematics.transform import Transform
from kbot.world.world import Box, Capsule, Cylinder, Ellipsoid, Shape, Sphere, TriangleMesh

Points = NDArray[np.float64]

_ROUND = 32
"""Corners of the polygon that replaces a circle. It contains the circle and is half a percent larger."""
_MOST_VERTICES = 96
"""Meshes with more vertices are reduced to their extreme vertices in twice as many directions."""


def footprint(shape: Shape, pose: Transform, low: float, high: float) -> Points | None:
    """Corners (n, 2) in m, counter-clockwise, of the convex outline of a shape between two heights.

    None if nothing of the shape is between them, or the shape is infinite (planes, height fields).
    """
    around = corners(shape)
    if around is None:
        return None
    points = pose.apply(around)
    z = points[:, 2]
    if z.min() >= high or z.max() <= low:
        return None
    inside = [points[(z >= low) & (z <= high)]]
    for height in (low, high):
        above, below = points[z > height], points[z < height]
        if len(above) and len(below):
            share = (height - below[:, None, 2]) / (above[None, :, 2] - below[:, None, 2])
            inside.append((below[:, None] + share[..., None] * (above[None] - below[:, None])).reshape(-1, 3))
    return convex_outline(np.concatenate(inside)[:, :2])


def top(shape: Shape, pose: Transform) -> float:
    """Height in m of a shape's highest point. For an infinite shape it is that of its pose."""
    around = corners(shape)
    return float((pose.translation if around is None else pose.apply(around).max(axis=0))[2])


def corners(shape: Shape) -> Points | None:
    """Points (n, 3) in m whose hull contains a shape. None for an infinite shape."""
    match shape:
        case Box(size=size):
            box: Points = _signs() * (np.array(size) / 2)
            return box
        case Cylinder(radius=radius, length=length):
            ring = _ring(radius)
            tube: Points = np.concatenate([np.insert(ring, 2, z, axis=1) for z in (-length / 2, length / 2)])
            return tube
        case Sphere(radius=radius):
            sphere: Points = _ball() * radius
            return sphere
        case Ellipsoid(radii=radii):
            ellipsoid: Points = _ball() * np.array(radii)
            return ellipsoid
        case Capsule(radius=radius, length=length):
            ball = _ball() * radius
            return np.concatenate([ball + np.array((0.0, 0.0, z)) for z in (-length / 2, length / 2)])
        case TriangleMesh(vertices=vertices):
            return _extreme(vertices)
    return None


def _signs() -> Points:
    signs: Points = np.array(np.meshgrid((-1.0, 1.0), (-1.0, 1.0), (-1.0, 1.0))).reshape(3, -1).T
    return signs


def _ring(radius: float, count: int = _ROUND) -> Points:
    angles = np.arange(count) * (2 * np.pi / count)
    ring: Points = radius / np.cos(np.pi / count) * np.stack([np.cos(angles), np.sin(angles)], axis=1)
    return ring


def _ball() -> Points:
    """Points whose hull contains the unit ball: rings at evenly spaced latitudes."""
    grown = 1.0 / np.cos(np.pi / 16)
    rings = [
        np.insert(_ring(np.cos(latitude) * grown), 2, np.sin(latitude) * grown, axis=1)
        for latitude in np.linspace(-np.pi / 2, np.pi / 2, 9)
    ]
    return np.concatenate(rings)


def _extreme(vertices: Points) -> Points:
    """The extreme vertices in many directions, which determine the hull of a fine mesh."""
    if len(vertices) <= _MOST_VERTICES:
        return vertices
    index = np.arange(2 * _MOST_VERTICES) + 0.5
    polar = np.arccos(1 - 2 * index / len(index))
    around = np.pi * (1 + 5**0.5) * index
    directions = np.stack([np.cos(around) * np.sin(polar), np.sin(around) * np.sin(polar), np.cos(polar)])
    chosen: Points = vertices[np.unique(np.argmax(vertices @ directions, axis=0))]
    return chosen


def convex_outline(points: Points) -> Points:
    """Corners (n, 2) of the convex hull of points (m, 2), counter-clockwise."""
    return np.array(convex_hull((x, y) for x, y in points.tolist()))
