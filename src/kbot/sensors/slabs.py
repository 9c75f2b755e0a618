"""Distances to many boxes at rest along beams that are spread evenly in a plane.

Each box is only held against the beams that its bounding sphere covers. A beam meets it where it is between
all three pairs of opposite faces at once (T. L. Kay and J. T. Kajiya, "Ray tracing complex scenes", SIGGRAPH
1986).
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


class Slabs:
    """Boxes, and the fan of beams that is held against them."""

    def __init__(
        self, centres: Array, axes: Array, halves: Array, first: float, step: float, beams: int
    ) -> None:
        """Boxes by `centres` (n, 3), `axes` (n, 3, 3; columns in the world) and `halves` (n, 3), half their
        edges in m. The beams start at the angle `first` about the sensor's z, `step` apart (rad, not 0), and
        go no further round than once."""
        self._centres, self._radii = centres, np.sqrt((halves**2).sum(axis=1))
        count = len(centres)
        # the three axes of all boxes one after the other: what is along an axis is a row of (3, n)
        self._axes = np.ascontiguousarray(axes.transpose(2, 0, 1)).reshape(3 * count, 3)
        self._offsets = (self._axes.reshape(3, count, 3) * centres).sum(axis=2)
        self._halves = np.ascontiguousarray(halves.T)
        self._first, self._step, self._beams = math.remainder(first, 2.0 * math.pi), step, beams
        self._turn = 2.0 * math.pi / abs(step)
        angles = first + step * np.arange(beams)
        self._cos, self._sin = np.cos(angles), np.sin(angles)
        self._nearest = np.empty(beams)

    def cast(self, place: Array, axes: Array, most: float) -> Array:
        """Distances (beams,) in m from `place` (3,) of a sensor with these `axes` (3, 3), inf where no box is
        met; those beyond `most` may be missed. The array is used again by the next call."""
        nearest = self._nearest
        nearest.fill(np.inf)
        box, beam = self._pairs(place, axes, most)
        if not len(box):
            return nearest
        offset = (self._axes @ place).reshape(3, -1) - self._offsets
        along = (self._axes @ axes[:, :2]).reshape(3, -1, 2)
        numbers = np.concatenate(
            [along[..., 0], along[..., 1], -self._halves - offset, self._halves - offset]
        ).take(box, axis=1)
        with np.errstate(divide="ignore", invalid="ignore"):
            inverse = 1.0 / (numbers[:3] * self._cos[beam] + numbers[3:6] * self._sin[beam])
            one, other = numbers[6:9] * inverse, numbers[9:] * inverse
        enters, leaves = np.minimum(one, other).max(axis=0), np.maximum(one, other).min(axis=0)
        # from within a box its far side is seen
        met = np.where(enters >= 0.0, enters, leaves)
        met[~((enters <= leaves) & (leaves >= 0.0))] = np.inf
        np.minimum.at(nearest, beam, met)
        return nearest

    def _pairs(self, place: Array, axes: Array, most: float) -> tuple[NDArray[np.intp], NDArray[np.intp]]:
        """Boxes and beams that may meet."""
        x, y, z = ((self._centres - place) @ axes).T
        away = np.hypot(x, y)
        near = np.flatnonzero((np.abs(z) <= self._radii) & (away <= self._radii + most))
        away, radii = away[near], self._radii[near]
        middle = np.mod((np.arctan2(y[near], x[near]) - self._first) / self._step, self._turn)
        seen = np.where(radii < away, np.arcsin(np.minimum(radii / np.maximum(away, 1e-300), 1.0)), math.pi)
        half = seen / abs(self._step) + 1e-6
        low, high = middle - half, middle + half
        # what lies across the first beam is met at the other end of the fan, a turn away
        low = np.ceil(np.concatenate([low - self._turn, low, low + self._turn])).astype(np.intp)
        high = np.floor(np.concatenate([high - self._turn, high, high + self._turn])).astype(np.intp)
        np.maximum(low, 0, out=low)
        counts = np.maximum(np.minimum(high, self._beams - 1) - low + 1, 0)
        ends = np.cumsum(counts)
        beam = np.arange(ends[-1] if len(ends) else 0) - np.repeat(ends - counts - low, counts)
        return np.repeat(np.concatenate([near, near, near]), counts), beam
