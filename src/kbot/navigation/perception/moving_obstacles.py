"""Finds obstacles that move, and their velocities, from the scans of a lidar.

A point moves if it is where an earlier scan saw free space. Walls and furniture never are, from wherever the
robot looks, so that this needs no model of them. The velocity of a group of such points is the slope of its
places over the last scans.
"""

from __future__ import annotations

import math
from collections import deque
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from kbot.messages.sensing import LaserScan
from kbot.navigation.perception.rolling_grid import SensorPlace

Values = NDArray[np.float64]

_EARLIER = 0.3
"""s. Age of the scan with which a new one is compared."""
_BEYOND = 0.12
"""m. The earlier beam must reach this far beyond a point, more than noise and the estimate's error."""
_REACH = 5.0
"""m. Obstacles further away are not near within the horizon of the controller."""
_GAP = 0.25
"""m between points of different obstacles."""
_LARGEST = 1.5
"""m. A larger group is a wall that comes into sight."""
_FEWEST = 3
"""Points of an obstacle."""
_MOVING_SHARE = 0.25
"""Share of its points that must move: of an obstacle that slides along its visible side, few do. Without a
share, posts that stand close together seem to move."""
_SAME = 0.5
"""m. An obstacle does not move further between two scans."""
_MEMORY = 0.5
"""s of places that the velocity is the slope of."""
_SHORTEST = 0.12
"""s of places without which the velocity is unknown."""
_SLOWEST = 0.15
"""m/s. Slower obstacles are seen in time where they are."""


@dataclass(frozen=True, slots=True)
class MovingObstacle:
    """A disc: its middle and radius in m, and its velocity in m/s, in the frame of the pose estimate."""

    x: float
    y: float
    radius: float
    vx: float
    vy: float


@dataclass(slots=True)
class _Track:
    places: deque[tuple[float, float, float]] = field(default_factory=deque)
    radius: float = 0.0


class MovingObstacles:
    """`obstacles` are those that moved in the latest scan."""

    def __init__(self) -> None:
        self._scans: deque[tuple[float, LaserScan, SensorPlace]] = deque()
        self._tracks: list[_Track] = []
        self.obstacles: list[MovingObstacle] = []

    def add(self, scan: LaserScan, place: SensorPlace) -> None:
        """Process a scan and the place of its lidar when it measured."""
        time = scan.header.stamp.seconds
        self._scans.append((time, scan, place))
        while len(self._scans) > 1 and self._scans[1][0] <= time - _EARLIER:
            self._scans.popleft()
        then, earlier, earlier_place = self._scans[0]
        groups = _moving_groups(scan, place, earlier, earlier_place) if time - then >= _EARLIER / 2 else []
        tracks = []
        for points in groups:
            middle = (points.min(axis=0) + points.max(axis=0)) / 2.0
            radius = float(np.hypot(*(points - middle).T).max())
            track = self._nearest(*middle.tolist()) or _Track()
            track.places.append((time, *middle.tolist()))
            while track.places[0][0] < time - _MEMORY:
                track.places.popleft()
            track.radius = max(radius, 0.9 * track.radius)  # from the side, it looks smaller
            tracks.append(track)
        # an obstacle that is hidden for a moment is still there
        tracks += [track for track in self._tracks if track.places[-1][0] > time - _EARLIER]
        self._tracks = tracks
        known = [_obstacle(track, time) for track in tracks]
        self.obstacles = [obstacle for obstacle in known if obstacle is not None]

    def _nearest(self, x: float, y: float) -> _Track | None:
        """The track that ends nearest to a point, which is then removed from the tracks."""
        near = [(math.hypot(track.places[-1][1] - x, track.places[-1][2] - y), i)
                for i, track in enumerate(self._tracks)]  # fmt: skip
        distance, index = min(near, default=(math.inf, 0))
        return self._tracks.pop(index) if distance < _SAME else None


def _obstacle(track: _Track, now: float) -> MovingObstacle | None:
    """The obstacle now, if its velocity is known and it moves."""
    times, xs, ys = np.array(track.places).T
    if times[-1] - times[0] < _SHORTEST:
        return None
    off = times - times.mean()
    vx, vy = float(off @ xs / (off @ off)), float(off @ ys / (off @ off))
    if math.hypot(vx, vy) < _SLOWEST:
        return None
    passed = now - float(times[-1])
    return MovingObstacle(float(xs[-1]) + vx * passed, float(ys[-1]) + vy * passed, track.radius, vx, vy)


def _moving_groups(
    scan: LaserScan, place: SensorPlace, earlier: LaserScan, earlier_place: SensorPlace
) -> list[Values]:
    """The points (n, 2) in m of each group of neighbouring points that moves."""
    ranges = scan.ranges.astype(np.float64)
    at = np.flatnonzero(np.isfinite(ranges) & (ranges > 0.0) & (ranges < _REACH))
    angle = place.yaw + place.side * (scan.angle_min + at * scan.angle_increment)
    points = np.stack([place.x + ranges[at] * np.cos(angle), place.y + ranges[at] * np.sin(angle)], axis=1)
    moves = _was_free(points, earlier, earlier_place)
    if np.count_nonzero(moves) < _FEWEST:
        return []
    ends = np.flatnonzero(np.hypot(*np.diff(points, axis=0).T) > _GAP) + 1
    groups = []
    for group, its in zip(np.split(points, ends), np.split(moves, ends), strict=True):
        extent = float(np.hypot(*(group.max(axis=0) - group.min(axis=0)))) if len(group) else 0.0
        if its.sum() >= max(_FEWEST, _MOVING_SHARE * len(group)) and extent < _LARGEST:
            groups.append(group)
    return groups


def _was_free(points: Values, scan: LaserScan, place: SensorPlace) -> NDArray[np.bool_]:
    """Whether the three nearest beams of a scan reached beyond each point."""
    x, y = points[:, 0] - place.x, points[:, 1] - place.y
    beyond = np.hypot(x, y) + _BEYOND
    turn = 2.0 * math.pi / abs(scan.angle_increment)
    angle = place.side * (np.arctan2(y, x) - place.yaw)
    nearest = np.rint((angle - scan.angle_min) / scan.angle_increment % turn).astype(np.intp)
    count = len(scan.ranges)
    is_inside = (nearest > 0) & (nearest < count - 1)
    nearest = np.where(is_inside, nearest, 1)
    reach = np.nan_to_num(scan.ranges.astype(np.float64), nan=0.0, posinf=scan.range_max, neginf=0.0)
    seen = np.minimum(np.minimum(reach[nearest - 1], reach[nearest]), reach[nearest + 1])
    free: NDArray[np.bool_] = is_inside & (seen > beyond)
    return free
