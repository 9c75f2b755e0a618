"""Estimates wheel radii, wheel separation and the pose of the sensor by least squares, without outliers.

J. Borenstein and L. Feng (UMBmark: A Benchmark Test for Measuring Odometry Errors in Mobile Robots, SPIE
1995) name the errors that are estimated: unequal wheels and an uncertain wheel base. A. Censi, A. Franchi,
L. Marchionni and G. Oriolo (Simultaneous Calibration of Odometry and Sensor Parameters for Mobile Robots,
IEEE Transactions on Robotics 29(2), 2013) estimate them together with the sensor's pose, from displacements
that scan matching gives. The search starts as theirs does: with the rotations, then the rest, both linear.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy.stats import chi2

from kbot.identify.intervals import DEVIATION_OF_MAD, half_widths
from kbot.identify.log import Array, Motions
from kbot.identify.noise import SMALLEST, Noise, covariances, estimate_noise, factor, whitened
from kbot.identify.observability import is_observable, observability
from kbot.identify.odometry_model import (
    COUNT,
    CURVATURE,
    LEFT,
    RIGHT,
    YAW,
    Linearization,
    X,
    Y,
    predicted,
    residuals,
)
from kbot.kinematics.angles import wrap_all

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
_STEPS = 30
"""Steps of a search, and halvings of one step, after which it ends as it is."""
_BLOCK = 100_000
"""Rows that are decomposed together."""
_UNOBSERVABLE_SIZE = 2.0
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
    """

    parameters: Array
    half_widths: Array
    is_outlier: NDArray[np.bool_]
    errors: Array


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
    model = Linearization.at(parameters, motions)
    is_outlier = _rough_outliers(model)
    kept = _kept(model, is_outlier)
    noise = _noise(kept, None)
    for _ in range(_ROUNDS):
        parameters = _with_forward_wheels(_least_squares(kept, noise, scales))
        model = Linearization.at(parameters, motions)
        before, is_outlier = is_outlier, _outliers(model, noise)
        if (before == is_outlier).all():
            break
        kept = _kept(model, is_outlier)
        noise = _noise(kept, noise)
    kept, errors = _kept(model, is_outlier), model.residuals
    del model  # its derivatives are among the largest arrays
    white, white_left = _weighted(kept, noise, scales)[1:]
    found = observability(kept, noise, white, scales)
    leaks = np.abs(found.unobservable).sum(axis=0)
    is_observed = leaks < _LARGEST_LEAK
    widths = np.full(COUNT, np.inf)
    known = _WIDER * half_widths(white @ found.observable.T, white_left, found.observable.T[is_observed], 3)
    uncertain = np.stack([known, _UNOBSERVABLE_SIZE * leaks[is_observed], found.bias[is_observed]])
    widths[is_observed] = np.linalg.norm(uncertain, axis=0) * scales[is_observed]
    estimate = np.where(is_observed, parameters, np.nan)
    if held is not None:
        estimate[held], widths[held] = parameters[held], 0.0
    return KinematicFit(estimate, widths, is_outlier, errors)


def rough_error(motions: Motions, nominal: Array) -> float:
    """The mean error in m of the translations, with the parameters from which `fit` starts.

    It is at least that of rounded numbers. NaN if the reference has no translations, or no rotations.
    """
    left = residuals(_start(motions, nominal), motions)
    errors = np.hypot(left[:, 0], left[:, 1])
    known = errors[np.isfinite(errors)]
    if not known.size or not np.isfinite(left[:, 2]).any():
        return np.nan
    return max(float(known.mean()), SMALLEST[0])


def _kept(model: Linearization, is_outlier: NDArray[np.bool_]) -> Linearization:
    """The displacements that are not outliers. Raises LinAlgError: there are none."""
    if is_outlier.all():
        raise np.linalg.LinAlgError("no parameters explain any displacement")
    return model.only(~is_outlier)


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
    turns = expected + wrap_all(measured[has_yaw, 2] - expected)
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


def _rough_outliers(model: Linearization) -> NDArray[np.bool_]:
    """Displacements with errors far above those of similar motions: noise grows with the motion."""
    left = model.residuals
    travel = model.travels.sum(axis=1)
    found = np.zeros(len(left), dtype=bool)
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


def _weighted(model: Linearization, noise: Noise, scales: Array) -> tuple[Array, Array, Array]:
    """The factor of the covariance, the whitened derivatives (3 M, 6) and the whitened residuals (3 M,)."""
    found = factor(model, noise)
    while found is None:  # rounding hides the noise that is not correlated
        noise = replace(
            noise,
            displacement_xy=2.0 * noise.displacement_xy,
            displacement_yaw=2.0 * noise.displacement_yaw,
        )
        if not np.isfinite(noise.squares()).all():
            raise np.linalg.LinAlgError("the covariance is singular")
        found = factor(model, noise)
    return found, _whitened_derivatives(found, model, scales), _whitened_residuals(found, model.residuals)


def _whitened_derivatives(factor: Array, model: Linearization, scales: Array) -> Array:
    slopes = model.derivatives * scales
    slopes[model.is_absent] = 0.0
    return whitened(factor, slopes.reshape(-1, COUNT))


def _whitened_residuals(factor: Array, residuals: Array) -> Array:
    white: Array = whitened(factor, np.nan_to_num(residuals).reshape(-1, 1)).ravel()
    return white


def _triangle(matrix: Array, target: Array) -> Array:
    """(n, n + 1) the triangle of a QR decomposition of a matrix (m, n), and the target (m,) turned as the
    matrix is. It is computed in blocks of rows, which need no copy of the matrix (J. Demmel, L. Grigori,
    M. Hoemmen and J. Langou, Communication-Optimal Parallel and Sequential QR and LU Factorizations, SIAM
    Journal on Scientific Computing 34(1), 2012)."""
    count = matrix.shape[1]
    found = np.zeros((count + 1, count + 1))
    for begin in range(0, len(matrix), _BLOCK):
        rows = slice(begin, begin + _BLOCK)
        block = np.column_stack([matrix[rows], target[rows]])
        found = np.asarray(np.linalg.qr(np.vstack([found, block]), mode="r"))
    return found[:count]


def _noise(model: Linearization, before: Noise | None) -> Noise:
    """The noise of displacements from which the largest 1 % were rejected."""
    trimmed = estimate_noise(model, before)
    return Noise(*np.sqrt(trimmed.squares() / _TRIMMED).tolist())


def _least_squares(model: Linearization, noise: Noise, scales: Array) -> Array:
    """Gauss-Newton with the covariance at the start. Combinations without any effect do not change."""
    factor, white, white_left = _weighted(model, noise, scales)
    parameters, motions = model.parameters, model.motions
    cost = float(white_left @ white_left)
    for _ in range(_STEPS):
        triangle = _triangle(white, white_left)  # the singular values and the solution are the same
        u, values, directions = np.linalg.svd(triangle[:, :COUNT])
        kept = is_observable(values)
        step = directions[kept].T @ ((u[:, kept].T @ triangle[:, COUNT]) / values[kept]) * scales
        for _ in range(_STEPS):
            trial: Array = parameters + step
            white_left = _whitened_residuals(factor, residuals(trial, motions))
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
        white = _whitened_derivatives(factor, Linearization.at(parameters, motions), scales)
    return parameters


def _outliers(model: Linearization, noise: Noise) -> NDArray[np.bool_]:
    """Displacements that differ from their prediction.

    Each is compared alone, whatever its neighbours are. If one that is correlated with them were compared
    with them, it could alternate between outlier and inlier.
    """
    left = np.nan_to_num(model.residuals)
    distances = (left * np.linalg.solve(covariances(model, noise), left[:, :, None])[:, :, 0]).sum(axis=1)
    found: NDArray[np.bool_] = distances > _REJECTED
    return found
