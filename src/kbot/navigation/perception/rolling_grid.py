"""An occupancy grid that moves with the robot and remembers what its lidars detected."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from kbot.kinematics.planar_pose import PlanarPose
from kbot.messages.sensing import LaserScan
from kbot.navigation.space.footprint import Outline

_HIT = 3
"""Evidence of a cell in which a beam ended. Three scans whose beams pass through it make it free again, so
that one wrong beam does not remove an obstacle, and one that moved away is soon forgotten."""
_BEYOND = 0.7
"""A beam must end this many cells beyond a cell's middle to show that the cell is free."""
_SURFACE = 0.2
"""m behind a detected point within which cells are of the same surface, seen with an error of the pose."""
_CELLS = 240
"""Cells of an edge."""
_REACH = 4.0
"""m. Beams free the cells within this distance."""
_SLACK = 8
"""The grid moves when the robot is more than a share of 1/`_SLACK` of its edge from its middle."""


@dataclass(frozen=True, slots=True)
class SensorPlace:
    """Where a level lidar is in the frame of a grid: its position in m, the direction of its x axis in rad,
    and -1 as `side` for a lidar that hangs upside down, whose angles count clockwise seen from above."""

    x: float
    y: float
    yaw: float
    side: float = 1.0

    @classmethod
    def on_base(cls, base: PlanarPose, base_from_sensor: NDArray[np.float64]) -> SensorPlace:
        """Its place if the base is at `base`; `base_from_sensor` is a (4, 4) matrix."""
        x, y = base_from_sensor[:2, 3].tolist()
        yaw = math.atan2(base_from_sensor[1, 0], base_from_sensor[0, 0])
        at = base @ PlanarPose(x, y, yaw)
        return cls(at.x, at.y, at.yaw, 1.0 if base_from_sensor[2, 2] >= 0.0 else -1.0)


class RollingGrid:
    """A square grid with the axes of the odometry frame. What no lidar has detected is free.

    `corner` is the lower left corner of the first cell in m."""

    def __init__(self, resolution: float) -> None:
        """`resolution`: a cell's edge in m."""
        self.resolution = resolution
        self._first = -(_CELLS // 2), -(_CELLS // 2)
        self._evidence = np.zeros((_CELLS, _CELLS), dtype=np.int8)

    @property
    def corner(self) -> tuple[float, float]:
        return self._first[0] * self.resolution, self._first[1] * self.resolution

    @property
    def size(self) -> float:
        """The edge of the grid in m."""
        return _CELLS * self.resolution

    @property
    def occupied(self) -> NDArray[np.bool_]:
        """The occupied cells: rows along y, columns along x."""
        found: NDArray[np.bool_] = self._evidence > 0
        return found

    def clear(self) -> None:
        """Forget everything."""
        self._evidence[:] = 0

    def suspect(self, pose: PlanarPose, outline: Outline, reach: float) -> None:
        """Occupy all cells within `reach` (m) of a pose except those of the outline there, until a beam
        passes through them. A robot that does not see all around may have an obstacle behind it."""
        (left, right), (low, high) = self._span(pose.x, 0, reach), self._span(pose.y, 1, reach)
        x = (np.arange(left, right) + self._first[0] + 0.5) * self.resolution
        y = (np.arange(low, high) + self._first[1] + 0.5) * self.resolution
        local = np.stack(pose.local(*np.meshgrid(x, y)), axis=-1)
        own = outline.holds(local.reshape(-1, 2)).reshape(local.shape[:2])
        part = self._evidence[low:high, left:right]
        near = np.hypot(local[..., 0], local[..., 1]) < reach
        part[~own & (part == 0) & near] = 1

    def around(self, x: float, y: float, half: float) -> tuple[NDArray[np.bool_], tuple[float, float]]:
        """The occupied cells in a square of half the edge `half` (m) around a point, and its corner in m."""
        (left, right), (low, high) = self._span(x, 0, half), self._span(y, 1, half)
        corner = (left + self._first[0]) * self.resolution, (low + self._first[1]) * self.resolution
        return self._evidence[low:high, left:right] > 0, corner

    def center_on(self, x: float, y: float) -> None:
        """Move the grid so that a point is near its middle. What leaves the grid is forgotten."""
        half = _CELLS // 2
        ideal = (math.floor(x / self.resolution) - half, math.floor(y / self.resolution) - half)
        off = ideal[0] - self._first[0], ideal[1] - self._first[1]
        if max(abs(off[0]), abs(off[1])) <= _CELLS // _SLACK:
            return
        moved = np.zeros_like(self._evidence)
        if max(abs(off[0]), abs(off[1])) < _CELLS:
            rows, columns = _overlap(off[1], _CELLS), _overlap(off[0], _CELLS)
            moved[rows[1], columns[1]] = self._evidence[rows[0], columns[0]]
        self._evidence, self._first = moved, ideal

    def add(self, scan: LaserScan, place: SensorPlace) -> None:
        """Free the cells through which the beams of a scan pass, and occupy those in which they end."""
        ranges = _plain(scan.ranges)
        self._lower(scan, place, _REACH, -_BEYOND * self.resolution, 1)
        ends = np.flatnonzero(np.isfinite(scan.ranges) & (ranges > 0.0))
        angles = place.yaw + place.side * (scan.angle_min + ends * scan.angle_increment)
        column, row = self._cell(
            place.x + ranges[ends] * np.cos(angles), place.y + ranges[ends] * np.sin(angles)
        )
        inside = (row >= 0) & (row < _CELLS) & (column >= 0) & (column < _CELLS)
        self._evidence[row[inside], column[inside]] = _HIT

    def forget_seen(self, scan: LaserScan, place: SensorPlace) -> None:
        """Forget the surfaces that a lidar sees, which it detects again. All others are kept."""
        self._lower(scan, place, self.size, _SURFACE, _HIT)

    def _lower(self, scan: LaserScan, place: SensorPlace, reach: float, beyond: float, by: int) -> None:
        """Lower the evidence of each cell within `reach` (m) that is nearer than both beams beside its
        middle, plus `beyond` (m)."""
        (left, right), (low, high) = self._span(place.x, 0, reach), self._span(place.y, 1, reach)
        part = self._evidence[low:high, left:right]
        row, column = np.nonzero(part)  # there is nothing to change in the others
        if not len(row) or not scan.angle_increment:
            return
        ranges = np.minimum(_plain(scan.ranges), scan.range_max)
        x = (column + left + self._first[0] + 0.5) * self.resolution - place.x
        y = (row + low + self._first[1] + 0.5) * self.resolution - place.y
        angle = place.side * (np.arctan2(y, x) - place.yaw)
        turn = 2.0 * math.pi / abs(scan.angle_increment)
        beam = ((angle - scan.angle_min) / scan.angle_increment) % turn
        last = len(ranges) - 1
        before = beam.astype(np.intp)
        seen = before < last if last else before == last
        before = np.minimum(before, last)
        nearer = np.minimum(ranges[before], ranges[np.minimum(before + 1, last)])
        passed = seen & (np.hypot(x, y) < nearer + beyond)
        part[row[passed], column[passed]] = np.maximum(part[row[passed], column[passed]] - by, 0)

    def _cell(
        self, x: NDArray[np.float64], y: NDArray[np.float64]
    ) -> tuple[NDArray[np.intp], NDArray[np.intp]]:
        """The columns and rows of points in m, which may be outside the grid."""
        column = np.floor(x / self.resolution).astype(np.intp) - self._first[0]
        row = np.floor(y / self.resolution).astype(np.intp) - self._first[1]
        return column, row

    def _span(self, middle: float, axis: int, half: float) -> tuple[int, int]:
        """The first cell, and the one after the last, within `half` of a coordinate."""
        first = math.floor((middle - half) / self.resolution) - self._first[axis]
        last = math.ceil((middle + half) / self.resolution) - self._first[axis]
        return min(max(first, 0), _CELLS), min(max(last, 0), _CELLS)


def _plain(ranges: NDArray[np.floating[Any]]) -> NDArray[np.float64]:
    """Ranges in m without NaN and negative infinity, which become 0."""
    return np.nan_to_num(ranges.astype(np.float64), nan=0.0, posinf=math.inf, neginf=0.0)


def _overlap(off: int, count: int) -> tuple[slice, slice]:
    """The cells that are kept when the grid moves by `off` cells: where they were, and where they are
    then."""
    if off >= 0:
        return slice(off, count), slice(0, count - off)
    return slice(0, count + off), slice(-off, count)
