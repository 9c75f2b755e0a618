"""The convex hull of points in the plane."""

from __future__ import annotations

from collections.abc import Iterable

Point = tuple[float, float]
"""x and y in m."""


def convex_hull(points: Iterable[Point], tolerance: float = 0.0) -> list[Point]:
    """Corners of the convex hull, counter-clockwise (Andrew's monotone chain). Points on a line have one or
    two.

    A corner is left out if its triangle with the adjacent corners is smaller than half of `tolerance` (m^2).
    Rounding makes such triangles from points on a line.
    """
    unique = sorted(set(points))
    if len(unique) < 3:
        return unique
    hull: list[Point] = []
    for run in (unique, unique[::-1]):
        half: list[Point] = []
        for point in run:
            while len(half) > 1 and twice_area(half[-2], half[-1], point) <= tolerance:
                half.pop()
            half.append(point)
        hull += half[:-1]
    return hull


def twice_area(a: Point, b: Point, c: Point) -> float:
    """Twice the area of a triangle in m^2, positive if its corners are counter-clockwise."""
    return (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0])
