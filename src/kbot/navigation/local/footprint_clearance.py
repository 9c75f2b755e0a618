"""The distance between a robot's outline and the nearest obstacle, for many poses at once."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from numpy.typing import NDArray

from kbot.navigation.footprint import Outline
from kbot.navigation.local.distance_field import DistanceField

Values = NDArray[np.float64]
Positions = NDArray[np.floating[Any]]


class FootprintClearance:
    """Computes the clearance of the true outline.

    `inner` is the radius in m of the largest circle about the outline's middle that is inside it, and `outer`
    that of the smallest circle around it. Only poses between the two need the points of the outline."""

    def __init__(self, outline: Outline, spacing: float) -> None:
        """`spacing`: the largest distance in m between two points at which the outline is checked."""
        self.middle = outline.middle
        points = _along(outline.corners, spacing)
        self._points = points
        off = points - self.middle
        self.outer = float(np.hypot(*off.T).max())
        edges = np.roll(outline.corners, -1, axis=0) - outline.corners
        across = np.stack([edges[:, 1], -edges[:, 0]], axis=1) / np.hypot(*edges.T)[:, None]
        self.inner = float(((outline.corners - self.middle) * across).sum(axis=1).min())

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
            clearance.ravel()[exact] = np.minimum.reduce(at_points, axis=0)
        return clearance


def _along(corners: Values, spacing: float) -> Values:
    """Points at most `spacing` apart along a closed line through corners."""
    points = []
    for start, end in zip(corners, np.roll(corners, -1, axis=0), strict=True):
        count = max(1, math.ceil(float(np.hypot(*(end - start))) / spacing))
        points.append(start + (end - start) * (np.arange(count) / count)[:, None])
    return np.concatenate(points)
