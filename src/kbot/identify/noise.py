"""The covariance of the residuals of a log, with the sizes of its sources estimated from the residuals.

The sources are white noise of each displacement (scan matching), noise of each pose (a localisation; two
displacements share it) and slip of each wheel. The covariance is a band matrix in the order of time, so that
a log of an hour takes seconds.
"""

from __future__ import annotations

from dataclasses import astuple, dataclass

import numpy as np
from scipy.linalg.lapack import dpbtrf, dtbtrs
from scipy.optimize import minimize

from kbot.identify.log import Array, Motions
from kbot.identify.odometry_model import LEFT, RIGHT

_BAND = 6
"""A displacement has three components and is correlated with its neighbours."""
_SOURCES = 6
_MOST = 1600
"""Displacements from which the sizes of the sources are estimated, in a few pieces of the log. More would
change the weights little, and take longer than everything else."""
_PIECES = 4
"""Evenly spread over the log, because its noise may change."""
_PRECISE = 1e-7
"""Relative change of the likelihood at which the search for the sizes ends."""
_RANGE = 1e4
"""Ratio of the largest to the smallest size of a source that is considered."""
SMALLEST = (1e-7, 1e-7)
"""Smallest noise in m and rad: numbers in a file are rounded."""


@dataclass(frozen=True, slots=True)
class Noise:
    """Sizes (standard deviations) of the sources.

    displacement_xy, displacement_yaw  of each displacement, in m and rad
    pose_xy, pose_yaw                  of each pose, in m and rad
    slip                               of each wheel, relative to its travel in a displacement
    slip_walk                          of each wheel, in sqrt(m): its variance is proportional to its travel
    """

    displacement_xy: float
    displacement_yaw: float
    pose_xy: float
    pose_yaw: float
    slip: float
    slip_walk: float

    def squares(self) -> Array:
        """(6,) the variances of the sources."""
        sizes: Array = np.array(astuple(self))
        return sizes * sizes


class Sources:
    """The covariances of sources of size 1, as bands (`_BAND`, 3 M) below the diagonal."""

    def __init__(self, parameters: Array, motions: Motions, displacements: Array, derivatives: Array) -> None:
        """`displacements` are the predicted ones and `derivatives` those by `parameters`: the measured ones
        may be wrong."""
        self.is_absent = ~np.isfinite(motions.displacements)
        """(M, 3), the components that the reference does not have."""
        count = len(motions)
        blocks = np.zeros((_SOURCES, count, 3, 3))
        beside = np.zeros((_SOURCES, max(count - 1, 0), 3, 3))
        blocks[0, :, [0, 1], [0, 1]] = 1.0
        blocks[1, :, 2, 2] = 1.0
        # noise of the first pose turns and moves the displacement, noise of the second moves it
        blocks[2, :, [0, 1], [0, 1]] = 2.0
        lever = np.column_stack([displacements[:, 1], -displacements[:, 0], -np.ones(count)])
        blocks[3] = lever[:, :, None] * lever[:, None, :]
        blocks[3, :, 2, 2] += 1.0
        follows = motions.follows.astype(float)
        cos, sin = np.cos(displacements[:-1, 2]) * follows, np.sin(displacements[:-1, 2]) * follows
        beside[2, :, 0, 0], beside[2, :, 0, 1] = -cos, -sin
        beside[2, :, 1, 0], beside[2, :, 1, 1] = sin, -cos
        beside[3, :, :, 2] = lever[1:] * follows[:, None]
        for wheel, radius in ((0, LEFT), (1, RIGHT)):
            effect = derivatives[:, :, radius]  # per m of the radius, so per rad of slip times the radius
            travel = motions.travels()[:, wheel, None, None]
            square = (effect[:, :, None] * effect[:, None, :]) * parameters[radius] ** 2
            blocks[4] += square
            blocks[5] += square / np.maximum(travel * abs(parameters[radius]), 1e-9)
        present = ~self.is_absent
        blocks *= present[None, :, :, None] * present[None, :, None, :]
        beside *= present[None, 1:, :, None] * present[None, :-1, None, :]
        self._blocks = blocks
        self._bands = np.stack([_band(*both) for both in zip(blocks, beside, strict=True)])
        self._absent = self.is_absent.ravel().astype(float)

    def __len__(self) -> int:
        return len(self.is_absent)

    def part(self, begin: int, end: int) -> Sources:
        """The sources of the displacements from `begin` to `end`, exclusive."""
        found = object.__new__(Sources)
        found.is_absent = self.is_absent[begin:end]
        found._blocks = self._blocks[:, begin:end]
        found._bands = self._bands[:, :, 3 * begin : 3 * end].copy()
        columns = found._bands.shape[2]
        for below in range(1, _BAND):  # nothing is below the last row
            found._bands[:, below, columns - below :] = 0.0
        found._absent = self._absent[3 * begin : 3 * end]
        return found

    def factor(self, squares: Array) -> Array | None:
        """The Cholesky factor as a band. None if the covariance is singular in floating point."""
        bands = np.tensordot(squares, self._bands, axes=1)
        bands[0] += self._absent
        factor, info = dpbtrf(bands, lower=1, overwrite_ab=1)
        return None if info else factor

    def distances(self, squares: Array, values: Array) -> Array:
        """(M,) the squared distance of each displacement's residuals (M, 3) from 0, in units of the noise."""
        covariances = np.tensordot(squares, self._blocks, axes=1)
        covariances[:, [0, 1, 2], [0, 1, 2]] += self.is_absent
        found: Array = (values * np.linalg.solve(covariances, values[:, :, None])[:, :, 0]).sum(axis=1)
        return found

    def likelihood(self, squares: Array, values: Array) -> float:
        """The negative logarithm of the likelihood of residuals (3 M,), except for a constant."""
        factor = self.factor(squares)
        if factor is None:
            return np.inf
        white = whitened(factor, values[:, None])
        return float(np.log(factor[0]).sum() + (white**2).sum() / 2.0)


def whitened(factor: Array, values: Array) -> Array:
    """Residuals or derivatives (3 M, n) divided by the factor of their covariance."""
    found: Array = dtbtrs(factor, values, uplo="L")[0]
    return found


def _band(blocks: Array, beside: Array) -> Array:
    """A symmetric band matrix from its blocks (M, 3, 3) on and (M - 1, 3, 3) below the diagonal."""
    band = np.zeros((_BAND, 3 * len(blocks)))
    for row in range(3):
        for column in range(3):
            if row >= column:
                band[row - column, column::3] = blocks[:, row, column]
            if len(beside):
                band[3 + row - column, column : 3 * len(beside) : 3] = beside[:, row, column]
    return band


def estimate_noise(
    sources: Sources,
    residuals: Array,
    scales: tuple[float, float],
    travel: float,
    before: Noise | None = None,
) -> Noise:
    """The sizes with the largest likelihood.

    `residuals` (M, 3) are without outliers. `scales` are their typical sizes in m and rad, and `travel` is
    the typical travel of a wheel in m. The search starts at `before`, if given.
    """
    count = len(residuals)
    size = min(count, _MOST) // _PIECES
    begins = [0] if count <= _MOST else [round(i * (count - size) / (_PIECES - 1)) for i in range(_PIECES)]
    size = count if count <= _MOST else size
    pieces = [(sources.part(b, b + size), residuals[b : b + size].ravel()) for b in begins]
    xy, yaw = (max(scale, smallest) for scale, smallest in zip(scales, SMALLEST, strict=True))
    slip = max(xy / max(travel, 1e-9), 1e-9)
    largest = np.array([xy, yaw, xy, yaw, slip, xy / np.sqrt(max(travel, 1e-9))])
    largest = np.maximum(largest, 1e-12)

    def negative(logarithms: Array) -> float:
        squares = np.exp(2.0 * logarithms)
        value = sum(part.likelihood(squares, values) for part, values in pieces)
        return value if np.isfinite(value) else 1e300

    start = np.log(largest * 0.4) if before is None else np.log(before.squares()) / 2.0
    bounds = [(np.log(one / _RANGE), np.log(one * 30.0)) for one in largest]
    start = np.clip(start, *np.transpose(bounds))
    options = {"maxiter": 40, "ftol": _PRECISE}
    found = minimize(negative, start, method="L-BFGS-B", bounds=bounds, options=options)
    return Noise(*np.exp(found.x).tolist())
