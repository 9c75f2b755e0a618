"""Estimates wheel radii, wheel separation and the pose of the sensor by least squares, without outliers.

J. Borenstein and L. Feng (UMBmark: A Benchmark Test for Measuring Odometry Errors in Mobile Robots, SPIE
1995) name the errors that are estimated: unequal wheels and an uncertain wheel base. A. Censi, A. Franchi,
L. Marchionni and G. Oriolo (Simultaneous Calibration of Odometry and Sensor Parameters for Mobile Robots,
IEEE Transactions on Robotics 29(2), 2013) estimate them together with the sensor's pose, from displacements
that scan matching gives. The search starts as theirs does: with the rotations, then the rest, both linear.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.stats import chi2

from kbot.identify.intervals import DEVIATION_OF_MAD, half_widths
from kbot.identify.log import Array, Motions, wrapped
from kbot.identify.noise import SMALLEST, Noise, Sources, estimate_noise, whitened
from kbot.identify.odometry_model import (
    COUNT,
    CURVATURE,
    LEFT,
    RIGHT,
    YAW,
    X,
    Y,
    derivatives,
    predicted,
    residuals,
)

_KEPT = 0.99
"""Share of Gaussian noise that is not rejected as outliers. A larger one would keep more of the small slips,
which are all in one direction."""
_REJECTED = float(chi2.ppf(_KEPT, 3))
"""Squared distance of an outlier, in units of the noise."""
_TRIMMED = float(chi2.cdf(_REJECTED, 5) / _KEPT)
"""Variance of Gaussian noise without what is rejected, relative to all of it."""
_WIDER = _KEPT / (_KEPT - 2.0 / 3.0 * _REJECTED * float(chi2.pdf(_REJECTED, 3)))
"""Factor of intervals, because what is rejected depends on the estimate: the share that is kept, divided by
the mean derivative of the influence of a residual (P. Huber, Robust Statistics, 1981, 6.3)."""
_ROUGH = 6.0
"""Distance of an outlier in the first rounds, in units of the typical noise of a similar motion."""
_ROUNDS = 12
"""Rounds of an estimate and its outliers, after which they are used as they are."""
_SETTLED = 5e-4
"""Share of the displacements that may still change between outliers and others when the search ends."""
_STEPS = 30
"""Steps of a search, and halvings of one step, after which it ends as it is."""
_SINGULAR = 1e-9
"""Ratio of singular values below which a combination of parameters has no effect on the log."""
_UNCERTAIN = 5.0
"""Standard error, relative to the typical size of a parameter, from which the log does not show it. The
search would only follow the noise."""
_HIDDEN_SIZE = 2.0
"""Combinations of parameters that the log does not show are within this many typical sizes."""
_LARGEST_LEAK = 0.05
"""Largest effect of such combinations on a parameter that the log shows, relative to their sizes."""
_STRAIGHT = 1e-3
"""Ratio of singular values below which the search does not start with what a log seems to show."""


@dataclass(frozen=True, slots=True)
class KinematicFit:
    """The estimate.

    parameters   (6,) as in `odometry_model`; NaN for those without any effect on the log
    half_widths  (6,) half the width of their 95 % intervals; infinite for those without any effect
    is_outlier   (M,)
    errors       (M, 3), measured minus predicted displacements
    noise        of the displacements that are not outliers
    """

    parameters: Array
    half_widths: Array
    is_outlier: NDArray[np.bool_]
    errors: Array
    noise: Noise


def fit(motions: Motions, nominal: Array, held: int | None = None) -> KinematicFit:
    """Estimate all parameters.

    Combinations of parameters without any effect on the log stay as in `nominal`, and so does the parameter
    of the index `held`.

    Raises:
        LinAlgError: the numbers are too large or too small, or no parameters explain them.
    """
    scales = _scales(nominal)
    if held is not None:
        scales[held] = 0.0
    parameters = _start(motions, nominal)
    if held is not None:
        parameters[held] = nominal[held]
    is_outlier = _rough_outliers(parameters, motions)
    noise = _noise(parameters, _kept(motions, is_outlier), None)
    for _ in range(_ROUNDS):
        kept = _kept(motions, is_outlier)
        parameters = _least_squares(parameters, kept, noise, scales)
        before, is_outlier = is_outlier, _outliers(parameters, motions, is_outlier, noise)
        if (before != is_outlier).mean() <= _SETTLED:
            break
        noise = _noise(parameters, _kept(motions, is_outlier), noise)
    kept = _kept(motions, is_outlier)
    parameters = _with_forward_wheels(parameters)
    factor, slopes, left = _weighted(parameters, kept, noise)
    white, white_left = whitened(factor, slopes * scales), whitened(factor, left[:, None])[:, 0]
    widths = np.full(COUNT, np.inf)
    found = parameters.copy()
    _, values, directions = np.linalg.svd(white, full_matrices=False)
    is_seen = _is_seen(values)
    hidden = directions[~is_seen]
    leaks = np.abs(hidden).sum(axis=0)
    shown = np.flatnonzero(leaks < _LARGEST_LEAK)
    basis = directions[is_seen]
    known = _WIDER * half_widths(white @ basis.T, white_left, basis.T[shown], 3)
    widths[shown] = np.hypot(known, _HIDDEN_SIZE * leaks[shown]) * scales[shown]
    found[leaks >= _LARGEST_LEAK] = np.nan
    if held is not None:
        found[held], widths[held] = parameters[held], 0.0
    return KinematicFit(found, widths, is_outlier, residuals(parameters, motions), noise)


def _kept(motions: Motions, is_outlier: NDArray[np.bool_]) -> Motions:
    """The displacements that are not outliers. Raises LinAlgError: there are none."""
    if is_outlier.all():
        raise np.linalg.LinAlgError("no parameters explain any displacement")
    return motions.only(~is_outlier)


def _is_seen(values: Array) -> NDArray[np.bool_]:
    """Which combinations of parameters the log shows, from the singular values of whitened derivatives."""
    seen: NDArray[np.bool_] = values > max(_SINGULAR * values[0], 1.0 / _UNCERTAIN)
    return seen


def _scales(nominal: Array) -> Array:
    """A typical size of each parameter, so that combinations of them can be compared."""
    radius = (nominal[LEFT] + nominal[RIGHT]) / 2.0
    return np.array(
        [radius, radius, nominal[CURVATURE], 1.0 / nominal[CURVATURE], 1.0 / nominal[CURVATURE], 1.0]
    )


def _start(motions: Motions, nominal: Array) -> Array:
    """The parameters with the smallest absolute errors, which tolerate outliers.

    The rotations are linear in radius times curvature of both wheels. With these, the displacements are
    linear in the wheel separation times the cosine and sine of the sensor's yaw, and in the sensor's position
    in its own frame.
    """
    sums = np.vstack([np.zeros(2), np.cumsum(motions.wheel_angles, axis=0)])
    angles = (sums[motions.stop] - sums[motions.start]) * (-1.0, 1.0)
    before = nominal[[LEFT, RIGHT]] * nominal[CURVATURE]
    measured = motions.displacements
    has_yaw = np.isfinite(measured[:, 2])
    # a long turn is measured without its full turns
    expected = angles[has_yaw] @ before
    turns = expected + wrapped(measured[has_yaw, 2] - expected)
    slopes = before + _least_absolute(angles[has_yaw], turns - expected, before)
    if not slopes.any():
        slopes = before
    has_xy = np.isfinite(measured[:, :2]).all(axis=1)
    unit = np.array([*slopes, 1.0, 0.0, 0.0, 0.0])
    ahead, aside, turn = np.real(predicted(unit, motions))[has_xy].T
    cos, sin = np.cos(turn) - 1.0, np.sin(turn)
    matrix = np.concatenate(
        [np.column_stack([ahead, aside, cos, -sin]), np.column_stack([aside, -ahead, sin, cos])]
    )
    old = 1.0 / nominal[CURVATURE] * np.array([np.cos(nominal[YAW]), np.sin(nominal[YAW])])
    own = _turn(nominal[[X, Y]], -nominal[YAW])
    start = np.array([*old, *own])
    target = np.concatenate([measured[has_xy, 0], measured[has_xy, 1]]) - matrix @ start
    u, w, own_x, own_y = start + _least_absolute(matrix, target, np.full(4, 1.0 / nominal[CURVATURE]))
    separation, yaw = float(np.hypot(u, w)), float(np.arctan2(w, u))
    if not separation:
        return nominal
    x, y = _turn(np.array([own_x, own_y]), yaw)
    return np.array([*(slopes * separation), 1.0 / separation, x, y, yaw])


def _with_forward_wheels(parameters: Array) -> Array:
    """The equivalent parameters whose mean wheel radius is positive: a robot that drives backwards with its
    sensor turned round moves the sensor in the same way."""
    if parameters[LEFT] + parameters[RIGHT] >= 0.0:
        return parameters
    mirrored = -parameters
    mirrored[YAW] = parameters[YAW] + np.pi
    return mirrored


def _turn(point: Array, angle: float) -> Array:
    cos, sin = np.cos(angle), np.sin(angle)
    return np.array([cos * point[0] - sin * point[1], sin * point[0] + cos * point[1]])


def _least_absolute(matrix: Array, target: Array, sizes: Array) -> Array:
    """The solution with the least sum of absolute errors, by reweighting. `sizes` are typical sizes of the
    unknowns. Combinations of unknowns with little effect on the target are 0."""
    if not len(target):
        return np.zeros(matrix.shape[1])
    scaled = matrix * sizes
    found = np.linalg.lstsq(scaled, target, rcond=_STRAIGHT)[0]
    for _ in range(30):
        left = np.abs(target - scaled @ found)
        weights = 1.0 / np.sqrt(np.maximum(left, 1e-3 * float(np.median(left)) + 1e-12))
        found = np.linalg.lstsq(scaled * weights[:, None], target * weights, rcond=_STRAIGHT)[0]
    result: Array = found * sizes
    return result


def _rough_outliers(parameters: Array, motions: Motions) -> NDArray[np.bool_]:
    """Displacements with errors far above those of similar motions: noise grows with the motion."""
    left = residuals(parameters, motions)
    travel = motions.travels() @ np.abs(parameters[[LEFT, RIGHT]])
    found = np.zeros(len(motions), dtype=bool)
    for errors, smallest in (
        (np.hypot(left[:, 0], left[:, 1]), SMALLEST[0]),
        (np.abs(left[:, 2]), SMALLEST[1]),
    ):
        is_known = np.isfinite(errors)
        if not is_known.any():
            continue
        matrix = np.column_stack([np.ones(is_known.sum()), travel[is_known]])
        sizes = 1.0 / np.linalg.norm(matrix, axis=0)
        slopes = _least_absolute(matrix, errors[is_known], sizes)
        if slopes[0] < 0.0:
            slopes = np.array([0.0, *_least_absolute(matrix[:, 1:], errors[is_known], sizes[1:])])
        if slopes[1] < 0.0:
            slopes = np.array([float(np.median(errors[is_known])), 0.0])
        typical = np.maximum(DEVIATION_OF_MAD * (matrix @ slopes), smallest)
        found[is_known] |= errors[is_known] > _ROUGH * typical
    return found


def _weighted(parameters: Array, motions: Motions, noise: Noise) -> tuple[Array, Array, Array]:
    """The factor of the covariance, the derivatives (3 M, 6) and the residuals (3 M,)."""
    slopes = derivatives(parameters, motions)
    sources = _sources(parameters, motions, slopes)
    factor = sources.factor(noise.squares())
    while factor is None:  # rounding
        if not np.isfinite(noise.squares()).all():
            raise np.linalg.LinAlgError("the covariance is singular")
        noise = Noise(*(2.0 * np.sqrt(noise.squares())).tolist())
        factor = sources.factor(noise.squares())
    is_absent = sources.is_absent
    slopes = np.where(is_absent[:, :, None], 0.0, slopes).reshape(-1, COUNT)
    left = np.where(is_absent, 0.0, residuals(parameters, motions)).ravel()
    return factor, slopes, left


def _sources(parameters: Array, motions: Motions, slopes: Array | None = None) -> Sources:
    """The sources of noise at an estimate. `slopes` are the derivatives there, if they are known."""
    slopes = derivatives(parameters, motions) if slopes is None else slopes
    return Sources(parameters, motions, np.real(predicted(parameters, motions)), slopes)


def _noise(parameters: Array, motions: Motions, before: Noise | None) -> Noise:
    sources = _sources(parameters, motions)
    left = residuals(parameters, motions)
    travel = float(np.median(motions.travels() @ np.abs(parameters[[LEFT, RIGHT]]))) / 2.0
    scales = (_spread(left[:, :2]), _spread(left[:, 2]))
    trimmed = estimate_noise(sources, np.nan_to_num(left), scales, travel, before)
    return Noise(*np.sqrt(trimmed.squares() / _TRIMMED).tolist())


def _spread(values: Array) -> float:
    known = values[np.isfinite(values)]
    return float(np.sqrt((known**2).mean())) if known.size else 0.0


def _least_squares(parameters: Array, motions: Motions, noise: Noise, scales: Array) -> Array:
    """Gauss-Newton with the covariance at the start. Combinations without any effect do not change."""
    factor, slopes, left = _weighted(parameters, motions, noise)
    white, white_left = whitened(factor, slopes * scales), whitened(factor, left[:, None])[:, 0]
    cost = float(white_left @ white_left)
    for _ in range(_STEPS):
        u, values, directions = np.linalg.svd(white, full_matrices=False)
        is_seen = _is_seen(values)
        step = directions[is_seen].T @ ((u[:, is_seen].T @ white_left) / values[is_seen]) * scales
        for _ in range(_STEPS):
            trial = parameters + step
            errors = np.nan_to_num(residuals(trial, motions)).ravel()
            white_left = whitened(factor, errors[:, None])[:, 0]
            new = float(white_left @ white_left)
            if new <= cost:
                break
            step = step / 2.0
        else:
            return parameters
        is_done = bool((np.abs(step) <= 1e-10 * scales).all()) or cost - new <= 1e-12 * cost
        parameters, cost = trial, new
        if is_done:
            return parameters
        slopes = derivatives(parameters, motions)
        slopes = np.where(np.isfinite(motions.displacements)[:, :, None], slopes, 0.0).reshape(-1, COUNT)
        white = whitened(factor, slopes * scales)
    return parameters


def _outliers(
    parameters: Array, motions: Motions, is_outlier: NDArray[np.bool_], noise: Noise
) -> NDArray[np.bool_]:
    """Displacements that differ from the prediction of the parameters and of the displacements before."""
    found = np.zeros(len(motions), dtype=bool)
    kept = motions.only(~is_outlier)
    factor, _, left = _weighted(parameters, kept, noise)
    white = whitened(factor, left[:, None])[:, 0].reshape(-1, 3)
    found[~is_outlier] = (white**2).sum(axis=1) > _REJECTED
    if is_outlier.any():  # an outlier is compared alone: what it is correlated with may be wrong
        alone = motions.only(is_outlier)
        sources, values = _sources(parameters, alone), np.nan_to_num(residuals(parameters, alone))
        found[is_outlier] = sources.distances(noise.squares(), values) > _REJECTED
    return found
