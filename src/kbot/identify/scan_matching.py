"""Measures the displacement of a lidar between scans by matching points to lines.

Source: A. Censi, An ICP Variant Using a Point-to-Line Metric, ICRA 2008. Libraries for point clouds align six
degrees of freedom, three of which a flat scan does not show. `kbot.navigation.perception.scan_matching`
matches near the motion that the wheels predict: its results depend on the wheels, which a calibration must
not. The motion of the robot within a scan is not corrected.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from kbot.identify.intervals import DEVIATION_OF_MAD
from kbot.identify.log import Array
from kbot.identify.nominal import Nominal
from kbot.kinematics.planar_pose import PlanarPose, integrate
from kbot.text import KbotError
from kbot.text.notes import note

_LONGEST = 0.2
_SHARPEST = 0.3
_LATEST = 1.0
"""A scan is matched to the one before once the wheels show a displacement of this many m or rad, or after
this many s: matching has about the same error for any small displacement."""
_LOST = 3.0
"""Time in s without a match after which the next scan is not compared with the last matched one."""
_FARTHEST = 0.3
"""Distance in m at which a point and a line still correspond, in the first rounds."""
_ROUNDS = 25
_DONE = 1e-6
"""Change in m and rad after which a match has converged."""
_SAME_SURFACE = 0.1
"""Distance in m of neighbouring points on one surface, or this share of their range if that is longer."""
_FEWEST = 30
"""Points with a line, below which a match is not used."""
_LEAST_OVERLAP = 0.5
"""Share of the points of a scan that must correspond."""
_FLATTEST = 0.02
"""Smallest eigenvalue of the mean square of the lines' normals: a corridor does not show the displacement
along it."""


@dataclass(frozen=True, slots=True)
class Scan:
    """The time in s, and the points (n, 2) in m in the order of the beams, NaN without a return."""

    time: float
    points: NDArray[np.float32]


def matched_poses(
    path: str, topic: str, scans: Sequence[Scan], wheels: tuple[Array, Array], nominal: Nominal
) -> tuple[Array, Array, NDArray[np.bool_]]:
    """Times (n,) and chained poses (n, 3) of the lidar, and (n,) whether a pose begins a new chain.

    A chain ends where no scan matches for some seconds. `wheels` are times and angles, with which the search
    starts.

    Raises:
        KbotError: no scans can be matched.
    """
    times, poses, is_first = list[float](), list[PlanarPose](), list[bool]()
    lost = 0.0
    before: tuple[Scan, _Lines, PlanarPose] | None = None
    for scan in sorted(scans, key=lambda scan: scan.time):
        points, pose, found = scan.points.astype(float), PlanarPose(), None
        if before is not None:
            start, lines, last = before
            guess = _by_wheels(start.time, scan.time, wheels, nominal)
            is_near = math.hypot(guess.x, guess.y) < _LONGEST and abs(guess.yaw) < _SHARPEST
            if is_near and scan.time - start.time < _LATEST:
                continue
            found = lines.match(points[np.isfinite(points).all(axis=1)], guess)
            if found is not None:
                pose = last @ found
            elif scan.time - start.time > _LOST:
                lost += scan.time - start.time
            else:
                continue
        before = scan, _Lines(points), pose
        times.append(scan.time)
        poses.append(pose)
        is_first.append(found is None)
    if all(is_first):
        raise KbotError(f"{path}: the scans of {topic} cannot be matched: too few points, or none in common")
    if lost:
        note(f"{path}: {lost:.0f} s of {topic} are not used, because the scans do not match")
    return np.array(times), np.array([(pose.x, pose.y, pose.yaw) for pose in poses]), np.array(is_first)


def _by_wheels(start: float, end: float, wheels: tuple[Array, Array], nominal: Nominal) -> PlanarPose:
    """The displacement of the lidar that the wheels and the description predict."""
    times, angles = wheels
    left, right = (
        float(np.interp(end, times, angles[:, side]) - np.interp(start, times, angles[:, side]))
        for side in (0, 1)
    )
    lidar = nominal.axle_from_sensor or PlanarPose()
    return integrate(
        PlanarPose(), left * nominal.left, right * nominal.right, nominal.drive.separation, lidar.inverse()
    )


class _Lines:
    """The points of a scan with the lines through their neighbours."""

    def __init__(self, points: Array) -> None:
        before, after = np.roll(points, 1, axis=0), np.roll(points, -1, axis=0)
        along = after - before
        gaps = np.linalg.norm(np.stack([points - before, after - points]), axis=2).max(axis=0)
        ranges = np.linalg.norm(points, axis=1)
        with np.errstate(invalid="ignore"):
            on_surface = gaps < _SAME_SURFACE * np.maximum(1.0, ranges)
        self.points = points[on_surface]
        normals = np.column_stack([-along[on_surface, 1], along[on_surface, 0]])
        self.normals = normals / np.maximum(np.linalg.norm(normals, axis=1), 1e-12)[:, None]
        self._tree = cKDTree(self.points) if len(self.points) else None

    def match(self, points: Array, guess: PlanarPose) -> PlanarPose | None:
        """The pose from which the points were seen, in the frame of the lines. None if it is uncertain.

        `points` (n, 2) are in m in the frame of the lidar at their own scan. All count as measured at one
        time: the motion within a scan is not corrected.
        """
        if self._tree is None or min(len(points), len(self.points)) < _FEWEST:
            return None
        pose, farthest = guess, _FARTHEST
        for _ in range(_ROUNDS):
            placed = pose.apply(points)
            distances, nearest = self._tree.query(placed, distance_upper_bound=farthest)
            is_near = np.isfinite(distances)
            if is_near.sum() < max(_FEWEST, _LEAST_OVERLAP * len(points)):
                return None
            placed, nearest = placed[is_near], nearest[is_near]
            normals = self.normals[nearest]
            errors = ((placed - self.points[nearest]) * normals).sum(axis=1)
            spread = DEVIATION_OF_MAD * float(np.median(np.abs(errors))) + 1e-4
            weights = 1.0 / np.maximum(1.0, np.abs(errors) / (1.5 * spread))  # Huber
            weights[np.abs(errors) > 6.0 * spread] = 0.0
            lever = placed - (pose.x, pose.y)
            turning = normals[:, 1] * lever[:, 0] - normals[:, 0] * lever[:, 1]
            matrix = np.column_stack([normals, turning])
            information = matrix.T @ (matrix * weights[:, None])
            if np.linalg.eigvalsh(information[:2, :2])[0] < _FLATTEST * weights.sum():
                return None
            step = np.linalg.solve(information, -matrix.T @ (weights * errors))
            pose = PlanarPose(pose.x + step[0], pose.y + step[1], pose.yaw + step[2])
            if np.abs(step).max() < _DONE:
                break
            farthest = max(0.7 * farthest, 0.1)
        return pose
