"""Finds how a robot moved from what its lidar detects: matches each scan to an earlier one.

Point-to-line ICP (Censi 2008) with a prior: the motion that the wheels and the gyroscope report. Where the
surroundings do not show a motion, as along a corridor or in the open, the prior decides.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from kbot.kinematics.angles import wrap
from kbot.kinematics.planar_pose import PlanarPose

Points = NDArray[np.float64]

_MOST_POINTS, _MOST_REFERENCES = 120, 240
"""Points of a scan and of the reference that are used. More cost time and add no accuracy."""
_ITERATIONS = 5
"""Steps of a match near the prediction. A search in a wider range has four times as many."""
_CONVERGED = 1e-4
"""m and rad."""
_NEAREST = 0.3
"""m. A point further from each point of the reference has no partner."""
_LINE = 0.25
"""m. Neighbours in a scan that are further apart are not on one surface."""
_RANGE_ERROR = 0.01
"""m. Distance from its line at which a point counts half: noise, and lines that are not straight."""
_COARSE_ERROR = 0.1
"""m. The same for the first iterations of a search in a wider range."""
_FITS, _FITS_NEAR = 0.06, 0.15
"""m. A point fits if it is nearer than this to a line, and to a point of it."""
_FEWEST = 20
"""A match needs at least this many points."""
_REFERENCE_MOVED, _REFERENCE_TURNED = 0.4, 0.4
"""m and rad of motion after which a scan becomes the reference. Errors add up with each reference."""
_OVERLAP = 0.7
"""Share of fitting points below which a scan becomes the reference, because the view has changed."""
_SLIP, _LEAST_SLIP = 0.3, 0.005
"""Standard deviation of the predicted motion since the last match: a share of the way, and m more."""
_TURN_SLIP, _LEAST_TURN_SLIP = 0.05, 0.001
"""The same for turns that a gyroscope measures, in rad."""
_WHEEL_TURN_SLIP, _LEAST_WHEEL_TURN_SLIP, _TURN_PER_WAY = 0.3, 0.005, 0.3
"""The same for turns that wheels measure, and rad per m of the way, as wheels of different sizes turn."""
_PUSHED = np.array([0.3, 0.3, 0.3])
"""m, m and rad: the same for a robot that was pushed."""
GOOD_FIT = 0.45
"""Share from which a match is used. A scan of a robot that tilts, as when it is pushed, shows the ground."""
LEAST_FIT = 0.25
"""Share of fitting points below which a scan does not show the same surroundings. In worlds of the BARN
challenge, the share is above 0.6, and after the robot was carried away below 0.2 in 9 of 10 cases."""


@dataclass(frozen=True, slots=True)
class Match:
    """The pose of the base when a scan was measured, and the share of its points that fit the reference."""

    pose: PlanarPose
    share: float

    @property
    def is_good(self) -> bool:
        return self.share >= GOOD_FIT

    @property
    def fits(self) -> bool:
        return self.share >= LEAST_FIT


@dataclass(frozen=True, slots=True)
class _Reference:
    """A scan: the pose of the base, the points (n, 2) in m in its frame, the normals (n, 2) of the surfaces
    there, and the distances (n) in m to the next points."""

    pose: PlanarPose
    points: Points
    normals: Points
    spacing: Points


class ScanMatcher:
    """Matches the scans of one lidar to a reference, one of its earlier scans."""

    def __init__(self) -> None:
        self._reference: _Reference | None = None
        self._earlier: _Reference | None = None
        self._before = PlanarPose()

    def match(self, points: Points, predicted: PlanarPose, has_gyro: bool) -> Match | None:
        """Match a scan: points (n, 2) in m in the base's frame, in the order of the beams, and the base's
        pose that wheels and gyroscope, if there is one, predict. None if there is nothing to match."""
        if self._reference is None or len(points) < _FEWEST:
            self._refer_to(points, predicted)
            return None
        before = self._before
        moved = math.hypot(predicted.x - before.x, predicted.y - before.y)
        slip = _LEAST_SLIP + _SLIP * moved
        turned = abs(wrap(predicted.yaw - before.yaw))
        if has_gyro:
            turn = _LEAST_TURN_SLIP + _TURN_SLIP * turned
        else:
            turn = _LEAST_WHEEL_TURN_SLIP + _WHEEL_TURN_SLIP * turned + _TURN_PER_WAY * moved
        some = points[:: math.ceil(len(points) / _MOST_POINTS)]
        best = _align(some, self._reference, predicted, np.array([slip, slip, turn]), _ITERATIONS)
        if not best.is_good:
            # perhaps a push: search a wider range, also in the reference before, for a better fit
            for reference in (self._reference, self._earlier):
                if reference is not None:
                    pushed = _align(some, reference, predicted, _PUSHED, 4 * _ITERATIONS)
                    best = pushed if pushed.share > max(best.share, _OVERLAP) else best
        self._before = best.pose
        return best

    def renew(self, points: Points, match: Match) -> None:
        """Make a matched scan the reference, if the robot has moved far or the view has changed."""
        if self._reference is None:
            return
        off = self._reference.pose.inverse() @ match.pose
        moved, turned = math.hypot(off.x, off.y), abs(off.yaw)
        if moved > _REFERENCE_MOVED or turned > _REFERENCE_TURNED or match.share < _OVERLAP:
            self._earlier = self._reference
            self._refer_to(points, match.pose)

    def _refer_to(self, points: Points, pose: PlanarPose) -> None:
        lines = _lines(points, pose) if len(points) >= _FEWEST else None
        self._reference = lines if lines is not None and len(lines.points) >= _FEWEST else None
        self._before = pose


def _lines(points: Points, pose: PlanarPose) -> _Reference:
    """The lines through the points of a scan, in the order of its beams."""
    step = 2
    after, before = np.roll(points, -step, axis=0), np.roll(points, step, axis=0)
    along = after - before
    length = np.hypot(along[:, 0], along[:, 1])
    turned = before[:, 0] * after[:, 1] - before[:, 1] * after[:, 0]
    # from the last point to the first, the beams turn back, unless there are points all around
    is_line = (length > 1e-6) & (length < 2.0 * _LINE) & (turned * np.median(turned) > 0.0)
    normals = np.stack([-along[:, 1], along[:, 0]], axis=1)[is_line] / length[is_line, None]
    every = max(1, math.ceil(int(is_line.sum()) / _MOST_REFERENCES))
    spacing = every * length[is_line][::every] / (2.0 * step)
    return _Reference(pose, points[is_line][::every], normals[::every], spacing)


def _align(
    points: Points, reference: _Reference, predicted: PlanarPose, deviation: Points, iterations: int
) -> Match:
    """The pose near the predicted one at which points fit a reference."""
    start = reference.pose.inverse() @ predicted
    references = reference.points
    pose = np.array([start.x, start.y, start.yaw])
    prior = (_RANGE_ERROR / deviation) ** 2
    short = references.astype(np.float32)
    squares = (short * short).sum(axis=1)
    share = 0.0
    for left in range(iterations, 0, -1):
        placed = PlanarPose(*pose.tolist()).apply(points)
        near = placed.astype(np.float32)
        apart = squares - 2.0 * (near @ short.T)
        partner = apart.argmin(axis=1)
        off = placed - references[partner]
        normal = reference.normals[partner]
        error = (off * normal).sum(axis=1)
        squared = (off * off).sum(axis=1)
        has_partner = squared < _NEAREST * _NEAREST
        is_fine = left <= _ITERATIONS
        if is_fine:  # new parts of a round surface pull at the last line that was visible
            has_partner &= squared - error * error < reference.spacing[partner] ** 2
        weight = has_partner / (1.0 + (error / (_RANGE_ERROR if is_fine else _COARSE_ERROR)) ** 2)
        arm = placed - pose[:2]
        slope = np.stack(
            [normal[:, 0], normal[:, 1], normal[:, 1] * arm[:, 0] - normal[:, 0] * arm[:, 1]], axis=1
        )
        weighted = slope * weight[:, None]
        matrix = weighted.T @ slope + np.diag(prior)
        pull = weighted.T @ error + prior * (pose - (start.x, start.y, start.yaw))
        change = np.linalg.solve(matrix, -pull)
        pose += change
        share = float(((squared < _FITS_NEAR**2) & (np.abs(error) < _FITS)).mean())
        if is_fine and np.abs(change).max() < _CONVERGED:
            break
    return Match(reference.pose @ PlanarPose(*pose.tolist()), share)
