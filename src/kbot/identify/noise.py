"""The covariance of the residuals of a log, with the sizes of its sources estimated from the residuals.

The sources are white noise of each displacement (scan matching), noise of each pose (a localisation; two
displacements share it) and slip of each wheel. Slip with a variance proportional to the travel is that of
K. Chong and L. Kleeman (Accurate Odometry and Error Modelling for a Mobile Robot, ICRA 1997). KBot adds slip
that is a constant share of the travel in a displacement, because a floor changes more slowly. The covariance
is a band matrix in the order of time, so that a log of an hour takes seconds.
"""

from __future__ import annotations

from dataclasses import astuple, dataclass
from functools import cached_property

import numpy as np
from scipy.linalg.lapack import dpbtrf, dtbtrs
from scipy.optimize import minimize

from kbot.identify.log import Array
from kbot.identify.odometry_model import LEFT, RIGHT, Linearization

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
_SHORTEST = 1e-9
"""Shortest travel in m, which keeps the slip of a wheel that stands finite."""
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

    def slip_variances(self, travels: Array) -> Array:
        """The variances of the slip, relative to the travels in m."""
        found: Array = self.slip**2 + self.slip_walk**2 / np.maximum(travels, _SHORTEST)
        return found


class Sources:
    """The covariances of M displacements for sources of size 1."""

    def __init__(self, model: Linearization) -> None:
        """The covariances follow from the predicted displacements, because measured ones may be wrong."""
        displacements, motions = model.predictions, model.motions
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
        travels = model.travels
        for wheel, radius in ((0, LEFT), (1, RIGHT)):
            # a slip of 1 has the effect of a radius that is twice as large
            effect = model.derivatives[:, :, radius] * model.parameters[radius]
            square = effect[:, :, None] * effect[:, None, :]
            blocks[4] += square
            blocks[5] += square / np.maximum(travels[:, wheel, None, None], _SHORTEST)
        self._is_absent = model.is_absent
        present = ~self._is_absent
        blocks *= present[:, :, None] * present[:, None, :]
        beside *= present[1:, :, None] * present[:-1, None, :]
        self._blocks, self._beside = blocks, beside

    @cached_property
    def _bands(self) -> Array:
        """(6, `_BAND`, 3 M) the parts on and below the diagonal."""
        return np.stack([_band(*both) for both in zip(self._blocks, self._beside, strict=True)])

    def factor(self, squares: Array) -> Array | None:
        """The Cholesky factor as a band. None if the covariance is singular in floating point."""
        bands = np.tensordot(squares, self._bands, axes=1)
        bands[0] += self._is_absent.ravel()
        factor, info = dpbtrf(bands, lower=1, overwrite_ab=1)
        return None if info else factor

    def covariances(self, squares: Array) -> Array:
        """(M, 3, 3) the covariance of each displacement alone. Absent components have a variance of 1."""
        found: Array = np.tensordot(squares, self._blocks, axes=1)
        found[:, [0, 1, 2], [0, 1, 2]] += self._is_absent
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


def estimate_noise(model: Linearization, before: Noise | None) -> Noise:
    """The sizes with the largest likelihood, from displacements that are not outliers.

    The search starts at `before`, if it is given.
    """
    count = len(model.motions)
    size = min(count, _MOST) // _PIECES
    begins = [0] if count <= _MOST else [round(i * (count - size) / (_PIECES - 1)) for i in range(_PIECES)]
    size = count if count <= _MOST else size
    parts = [model.only(slice(begin, begin + size)) for begin in begins]
    pieces = [(Sources(part), np.nan_to_num(part.residuals).ravel()) for part in parts]
    travel = max(float(np.median(model.travels.sum(axis=1))) / 2.0, _SHORTEST)
    xy = max(_spread(model.residuals[:, :2]), SMALLEST[0])
    yaw = max(_spread(model.residuals[:, 2]), SMALLEST[1])
    largest = np.array([xy, yaw, xy, yaw, xy / travel, xy / np.sqrt(travel)])

    def negative(logarithms: Array) -> float:
        squares = np.exp(2.0 * logarithms)
        value = sum(sources.likelihood(squares, values) for sources, values in pieces)
        return value if np.isfinite(value) else 1e300

    start = np.log(largest * 0.4) if before is None else np.log(before.squares()) / 2.0
    bounds = [(np.log(one / _RANGE), np.log(one * 30.0)) for one in largest]
    start = np.clip(start, *np.transpose(bounds))
    options = {"maxiter": 40, "ftol": _PRECISE}
    found = minimize(negative, start, method="L-BFGS-B", bounds=bounds, options=options)
    return Noise(*np.exp(found.x).tolist())


def _spread(values: Array) -> float:
    """The root mean square of the values that are present."""
    known = values[np.isfinite(values)]
    return float(np.sqrt((known**2).mean())) if known.size else 0.0
