"""The distance between a robot's outline and the nearest obstacle, for many poses at once."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from numpy.typing import NDArray

from kbot.navigation.space.distance_field import DistanceField
from kbot.navigation.space.footprint import Outline, edges

Values = NDArray[np.float64]
Positions = NDArray[np.floating[Any]]

_LONG = 1.6
"""The middles of robots longer than this, as a multiple of their width, are far from their ends."""
_RASTER = 41
"""Points along each side of an outline's box at which the middle of a circle may be."""
_MOST_CIRCLES = 8
"""Circles inside a long robot. Each is looked up for each pose."""


class FootprintClearance:
    """Computes the clearance of the true outline, which need not be convex.

    `middle` is the middle of a circle inside the outline with the radius `inner` in m, and `outer` is the
    radius of the smallest circle about the same middle around the outline. Only poses between the two need
    the points of the outline. `box` is the lower and the upper corner in m of the box around it."""

    def __init__(self, outline: Outline, spacing: float) -> None:
        """`spacing`: the largest distance in m between two points at which the outline is checked."""
        points = np.concatenate([_along(polygon, spacing) for polygon in outline.polygons])
        if outline.pieces:
            points = points[~outline.grown(-1e-6).holds(points)]
            self.middle, self.inner = _circles_inside(outline, points)[0]
        else:
            self.middle = outline.middle
            normals, offsets = edges(outline.corners)
            self.inner = float((offsets - self.middle @ normals).min())
        self._points = points
        self.box = points.min(axis=0), points.max(axis=0)
        self.outer = float(np.hypot(*(points - self.middle).T).max())
        # a thin post inside of a long robot may be far from its sides
        self._circles = _circles_inside(outline, points)[1:] if self.outer > _LONG * self.inner else []

    def of(self, field: DistanceField, x: Positions, y: Positions, yaw: Positions) -> NDArray[np.float32]:
        """The clearance in m at poses of the base (arrays of one shape), negative inside an obstacle.

        A clearance of more than `field.most` - `outer` is reported as that."""
        cos, sin = np.cos(yaw), np.sin(yaw)
        mx, my = self.middle.astype(cos.dtype)
        away = field.at(x + cos * mx - sin * my, y + sin * mx + cos * my)
        clearance = away - np.where(away < self.inner, self.inner, self.outer).astype(np.float32)
        exact = np.flatnonzero((away >= self.inner) & (away < field.most))
        if len(exact):
            c, s, cx, cy = (values.ravel()[exact] for values in (cos, sin, x, y))
            px, py = self._points.astype(cos.dtype).T[..., None]
            at_points = field.at(cx + (c * px - s * py), cy + (s * px + c * py))
            nearest = np.minimum.reduce(at_points, axis=0)
            for (ox, oy), radius in self._circles:
                there = field.at(cx + (c * ox - s * oy), cy + (s * ox + c * oy))
                np.minimum(nearest, there - np.float32(radius), out=nearest)
            clearance.ravel()[exact] = nearest
        return clearance


def _circles_inside(outline: Outline, boundary: Values) -> list[tuple[Values, float]]:
    """The largest circles inside an outline whose middles are not in each other: their middles and radii in
    m."""
    (left, low), (right, high) = outline.corners.min(axis=0), outline.corners.max(axis=0)
    x, y = np.meshgrid(np.linspace(left, right, _RASTER), np.linspace(low, high, _RASTER))
    places = np.stack([x.ravel(), y.ravel()], axis=1)
    places = places[outline.holds(places)]
    room = np.hypot(*(places[:, None] - boundary).transpose(2, 0, 1)).min(axis=1)
    circles: list[tuple[Values, float]] = []
    while len(places) and len(circles) < _MOST_CIRCLES:
        best = int(room.argmax())
        circles.append((places[best], float(room[best])))
        is_apart = np.hypot(*(places - places[best]).T) > room[best]
        places, room = places[is_apart], room[is_apart]
    return circles


def _along(corners: Values, spacing: float) -> Values:
    """Points at most `spacing` apart along a closed line through corners."""
    points = []
    for start, end in zip(corners, np.roll(corners, -1, axis=0), strict=True):
        count = max(1, math.ceil(float(np.hypot(*(end - start))) / spacing))
        points.append(start + (end - start) * (np.arange(count) / count)[:, None])
    return np.concatenate(points)
