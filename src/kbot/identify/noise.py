"""The covariance of the residuals of a log, with the sizes of its sources estimated from the residuals.

The sources are white noise of each displacement (scan matching), noise of each pose (a localisation; two
displacements share it) and slip of each wheel. Slip with a variance proportional to the travel is that of
K. Chong and L. Kleeman (Accurate Odometry and Error Modelling for a Mobile Robot, ICRA 1997). KBot adds slip
that is a constant share of the travel in a displacement, because a floor changes more slowly. The covariance
is a band matrix in the order of time, so that a log of an hour takes seconds.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import astuple, dataclass

import numpy as np
from scipy.linalg.lapack import dpbtrf, dtbtrs
from scipy.optimize import minimize

from kbot.identify.log import Array
from kbot.identify.odometry_model import LEFT, RIGHT, Linearization

_BAND = 6
"""A displacement has three components and is correlated with its neighbours."""
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


def _sources(model: Linearization) -> Iterator[tuple[Array, Array]]:
    """The covariance of M displacements for each source of size 1: (M, 3, 3) of each displacement, and
    (M - 1, 3, 3) of each with the one before it.

    They follow from the predicted displacements, because measured ones may be wrong. One source after the
    other needs the least memory.
    """
    displacements, motions = model.predictions, model.motions
    count = len(motions)
    present = ~model.is_absent
    both = (present[:, :, None] & present[:, None, :]).astype(float)
    both_beside = (present[1:, :, None] & present[:-1, None, :]).astype(float)
    none, none_beside = np.zeros((count, 3, 3)), np.zeros((max(count - 1, 0), 3, 3))
    for diagonal in ((1.0, 1.0, 0.0), (0.0, 0.0, 1.0)):
        yield both * np.diag(diagonal), none_beside
    # noise of the first pose turns and moves the displacement, noise of the second moves it
    follows = motions.follows.astype(float)
    cos, sin = np.cos(displacements[:-1, 2]) * follows, np.sin(displacements[:-1, 2]) * follows
    beside = none_beside.copy()
    beside[:, 0, 0], beside[:, 0, 1] = -cos, -sin
    beside[:, 1, 0], beside[:, 1, 1] = sin, -cos
    yield both * np.diag((2.0, 2.0, 0.0)), beside * both_beside
    lever = np.column_stack([displacements[:, 1], -displacements[:, 0], -np.ones(count)])
    block = lever[:, :, None] * lever[:, None, :]
    block[:, 2, 2] += 1.0
    beside = none_beside.copy()
    beside[:, :, 2] = lever[1:] * follows[:, None]
    yield block * both, beside * both_beside
    for exponent in (0, 1):
        block = none.copy()
        for wheel, radius in ((0, LEFT), (1, RIGHT)):
            # a slip of 1 has the effect of a radius that is twice as large
            effect = model.derivatives[:, :, radius] * model.parameters[radius]
            travels = np.maximum(model.travels[:, wheel, None, None], _SHORTEST)
            block += effect[:, :, None] * effect[:, None, :] / travels**exponent
        yield block * both, none_beside


def covariances(model: Linearization, noise: Noise) -> Array:
    """(M, 3, 3) the covariance of each displacement alone. Absent components have a variance of 1."""
    return _total(model, noise)[0]


def factor(model: Linearization, noise: Noise) -> Array | None:
    """The Cholesky factor of the covariance as a band. None if it is singular in floating point."""
    return _factor(_band(*_total(model, noise)))


def _total(model: Linearization, noise: Noise) -> tuple[Array, Array]:
    count = len(model.motions)
    total, total_beside = np.zeros((count, 3, 3)), np.zeros((max(count - 1, 0), 3, 3))
    for square, (block, beside) in zip(noise.squares(), _sources(model), strict=True):
        total += square * block
        total_beside += square * beside
    total[:, [0, 1, 2], [0, 1, 2]] += model.is_absent
    return total, total_beside


def _factor(band: Array) -> Array | None:
    found, info = dpbtrf(band, lower=1, overwrite_ab=1)
    return None if info else found


class _Likelihood:
    """Of the residuals of a few displacements. Keeps their covariance for each source, to be fast."""

    def __init__(self, model: Linearization) -> None:
        self._bands = np.stack([_band(*each) for each in _sources(model)])
        self._is_absent = model.is_absent.ravel()
        self._values = np.nan_to_num(model.residuals).reshape(-1, 1)

    def negative(self, squares: Array) -> float:
        """The negative logarithm of the likelihood, except for a constant."""
        band = np.tensordot(squares, self._bands, axes=1)
        band[0] += self._is_absent
        factor = _factor(band)
        if factor is None:
            return np.inf
        white = whitened(factor, self._values)
        return float(np.log(factor[0]).sum() + (white**2).sum() / 2.0)


def whitened(factor: Array, values: Array) -> Array:
    """Residuals or derivatives (3 M, n) divided by the factor of their covariance."""
    found = np.empty(values.shape, order="F")
    for column in range(values.shape[1]):
        found[:, column] = dtbtrs(factor, values[:, column], uplo="L")[0].ravel()
    return found


def _band(blocks: Array, beside: Array) -> Array:
    """A symmetric band matrix from its blocks (M, 3, 3) on and (M - 1, 3, 3) below the diagonal."""
    band = np.zeros((_BAND, 3 * len(blocks)), order="F")  # LAPACK's order, which needs no copy
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
    pieces = [_Likelihood(part) for part in parts]
    travel = max(float(np.median(model.travels.sum(axis=1))) / 2.0, _SHORTEST)
    xy = max(_spread(model.residuals[:, :2]), SMALLEST[0])
    yaw = max(_spread(model.residuals[:, 2]), SMALLEST[1])
    largest = np.array([xy, yaw, xy, yaw, xy / travel, xy / np.sqrt(travel)])

    def negative(logarithms: Array) -> float:
        squares = np.exp(2.0 * logarithms)
        value = sum(piece.negative(squares) for piece in pieces)
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
