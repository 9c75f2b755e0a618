"""A log of a drive: wheel speeds, a reference of the motion, commands and the gyro, by interval."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from kbot.kinematics.angles import wrap_all
from kbot.text import KbotError

Array = NDArray[np.float64]

_LONGEST_GAP = 60.0
"""Time in s from which a gap may be a jump of the clock, such as from simulated time to wall-clock time."""
_FEW = 100.0
"""A gap is a jump if it is also this many times as long as the median interval."""
_STOPPED = 0.01
"""Angle of the wheels in a stop, relative to the mean of all displacements: the encoders of a robot that
stands may change by a digit."""
FEWEST_MOTIONS = 4
"""Six parameters need more than the six numbers of two displacements, and a scale of the noise needs more."""


@dataclass(frozen=True, slots=True, kw_only=True)
class DriveLog:
    """N consecutive intervals. NaN marks what is absent.

    path           the file, for messages
    durations      (N,) in s
    wheel_speeds   (N, 2), left and right mean speed in rad/s, positive forwards
    displacements  (N, 3), pose of the sensor at the end of the interval in its own frame at the start (m, m,
                   rad). All NaN if the log has `poses`
    poses          (N, 3), pose of the sensor at the end of the interval in any fixed frame. All NaN if the
                   log has `displacements`
    commands       (N, 2), the commanded twist of the base in its own frame at the start of the interval:
                   forward speed in m/s, and counterclockwise turning speed in rad/s. NaN before the first
                   command
    gyro           (N,), turning speed in rad/s that the gyro measured
    new_frames     the intervals whose pose is in another fixed frame than the poses before it: the
                   displacement between the two is unknown
    sources        the topics of a recording from which the log was read, by their meaning
    """

    path: str
    durations: Array
    wheel_speeds: Array
    displacements: Array
    poses: Array
    commands: Array
    gyro: Array
    new_frames: Sequence[int] = ()
    sources: Mapping[str, str] = field(default_factory=dict)


@dataclass(frozen=True, slots=True, kw_only=True)
class Motions:
    """M displacements of the sensor that the reference shows, in the order of time.

    wheel_angles   (N, 2), angle in rad by which the wheels turned in each interval of the log, 0 if absent
    start, stop    (M,), the intervals `start` to `stop`, exclusive, of each displacement
    displacements  (M, 3), in m, m and rad. NaN marks an absent component
    """

    wheel_angles: Array
    start: NDArray[np.intp]
    stop: NDArray[np.intp]
    displacements: Array

    def __len__(self) -> int:
        return len(self.start)

    @property
    def follows(self) -> NDArray[np.bool_]:
        """(M - 1,) whether a displacement begins where the one before it ends. They then share a pose."""
        joined: NDArray[np.bool_] = self.stop[:-1] == self.start[1:]
        return joined

    def travels(self) -> Array:
        """(M, 2), the sum of the absolute angles of the wheels in each displacement, in rad."""
        sums = np.vstack([np.zeros(2), np.cumsum(np.abs(self.wheel_angles), axis=0)])
        found: Array = sums[self.stop] - sums[self.start]
        return found

    @property
    def is_moving(self) -> NDArray[np.bool_]:
        """(M,) whether a wheel turns. A stop shows no parameter, and the reference has less noise in it."""
        longest = self.travels().max(axis=1)
        moving: NDArray[np.bool_] = longest > _STOPPED * longest.mean()
        return moving

    def only(self, kept: NDArray[np.bool_] | slice) -> Motions:
        return Motions(
            wheel_angles=self.wheel_angles,
            start=self.start[kept],
            stop=self.stop[kept],
            displacements=self.displacements[kept],
        )


def jumps_ahead(times: Array) -> NDArray[np.intp]:
    """The indices of increasing times after which the clock jumps ahead."""
    if len(times) < 2:
        return np.array([], dtype=np.intp)
    steps = np.diff(times)
    typical = float(np.quantile(steps, 0.5, method="lower"))
    return np.flatnonzero(steps > max(_LONGEST_GAP, _FEW * typical))


def held(times: Array, values: Array, at: Array) -> Array:
    """The last value at or before each time of `at`, because a command applies until the next one.

    It is NaN before the first. The times must increase.
    """
    absent = np.full((1, *values.shape[1:]), np.nan)
    found: Array = np.concatenate([absent, values])[np.searchsorted(times, at, side="right")]
    return found


def motions_of(log: DriveLog) -> Motions:
    """The displacements for which the log has a reference and the speeds of both wheels.

    Two poses may be several intervals apart, as those of a slow localisation are.

    Raises:
        KbotError: there are too few, or nothing moves.
    """
    angles = log.wheel_speeds * log.durations[:, None]
    is_known: NDArray[np.bool_] = np.logical_and.reduce(np.isfinite(angles), axis=1)
    if np.isfinite(log.poses).any():
        start, stop, displacements = _between_poses(log.poses, log.new_frames)
    else:
        # the rotation is in every displacement that can be used, or the translation, or both
        rows = np.flatnonzero(np.isfinite(log.displacements).any(axis=1))
        start, stop, displacements = rows, rows + 1, log.displacements[rows]
    if not len(start):
        raise KbotError(
            f"{log.path} has no reference: the cells of its displacements or poses are empty. Identification "
            "compares the wheels with a reference, such as scan matching or a localisation"
        )
    unknown: NDArray[np.intp] = np.concatenate([[0], np.cumsum(~is_known)])
    is_usable: NDArray[np.bool_] = np.equal(unknown[stop], unknown[start])
    found = Motions(
        wheel_angles=np.where(is_known[:, None], angles, 0.0),
        start=start[is_usable],
        stop=stop[is_usable],
        displacements=displacements[is_usable],
    )
    if len(found) < FEWEST_MOTIONS:
        raise KbotError(
            f"{log.path} has wheel speeds and a reference in too few intervals: {len(found)}. Identification "
            f"needs at least {FEWEST_MOTIONS}"
        )
    _require_motion(log, found)
    return found


def _between_poses(
    poses: Array, new_frames: Sequence[int]
) -> tuple[NDArray[np.intp], NDArray[np.intp], Array]:
    at = np.flatnonzero(np.isfinite(poses).all(axis=1))
    before, after = poses[at[:-1]], poses[at[1:]]
    delta = after - before
    cos, sin = np.cos(before[:, 2]), np.sin(before[:, 2])
    displacements = np.column_stack(
        [
            cos * delta[:, 0] + sin * delta[:, 1],
            cos * delta[:, 1] - sin * delta[:, 0],
            wrap_all(delta[:, 2]),
        ]
    )
    is_known = ~np.isin(at[1:], new_frames)
    return at[:-1][is_known] + 1, at[1:][is_known] + 1, displacements[is_known]


_STILL_WHEEL = 1e-3
"""Angle in rad by which a wheel must turn in the whole log."""


def _require_motion(log: DriveLog, motions: Motions) -> None:
    if motions.travels().sum(axis=0).max() < _STILL_WHEEL:
        raise KbotError(f"{log.path} shows no motion: the wheels do not turn. Record a drive with turns")
    if not (np.abs(np.nan_to_num(motions.displacements)) > 0.0).any():
        raise KbotError(
            f"{log.path}: the wheels turn, but the reference does not move. Record a drive on the ground"
        )
