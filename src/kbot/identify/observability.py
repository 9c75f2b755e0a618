"""Finds which combinations of parameters a log shows, and how wrong the others can make the estimates.

Least squares takes the wheel angles as exact. If the encoders have noise, small differences between the
wheels are only noise, and what seems to follow from them is biased. The bias, and the share of the
information that is noise, follow from the size of the noise: W. Fuller, Measurement Error Models, 1987,
section 2.2. A log does not show which of its errors are noise of the encoders, and which are slip, which
causes no bias: all of them count as noise.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import eigh

from kbot.identify.log import Array
from kbot.identify.noise import Noise, covariances
from kbot.identify.odometry_model import COUNT, LEFT, RIGHT, Linearization

_SINGULAR = 1e-9
"""Ratio of singular values below which a combination of parameters has no effect on the log."""
_UNCERTAIN = 5.0
"""Standard error, relative to the typical size of a parameter, from which the log does not show it. The
search would only follow the noise."""
_MOST_NOISE = 0.1
"""Share of the information about a combination that may come from noise of the encoders."""
_STEP = 1e-4
"""Relative step of the wheel angles in derivatives."""


@dataclass(frozen=True, slots=True)
class Observability:
    """What a log shows, in units of the parameters' typical sizes.

    observable    (k, 6) orthonormal combinations that the log shows
    unobservable  (6 - k, 6) the others
    bias          (6,) the bias of the parameters if all errors are noise of the encoders
    """

    observable: Array
    unobservable: Array
    bias: Array


def is_observable(values: Array) -> NDArray[np.bool_]:
    """Which combinations have an effect on the log, from the singular values of whitened derivatives."""
    observable: NDArray[np.bool_] = values > max(_SINGULAR * values[0], 1.0 / _UNCERTAIN)
    return observable


def observability(model: Linearization, noise: Noise, white: Array, scales: Array) -> Observability:
    """Find what a log shows. `white` (3 M, 6) are the whitened derivatives by the parameters in `scales`."""
    # the triangle has the same singular values, and is small
    _, values, directions = np.linalg.svd(np.linalg.qr(white, mode="r"))
    effective = directions[is_observable(values)]
    information, from_noise, score = _second_moments(model, noise, scales)
    shares, turned = eigh(effective @ from_noise @ effective.T, effective @ information @ effective.T)
    combinations = turned.T @ effective
    is_real = shares < _MOST_NOISE
    bias = (combinations[is_real] @ score / (1.0 - shares[is_real])) @ combinations[is_real]
    unobservable = np.vstack([directions[~is_observable(values)], combinations[~is_real]])
    _, _, axes = np.linalg.svd(unobservable)
    return Observability(axes[len(unobservable) :], axes[: len(unobservable)], np.abs(bias))


def _second_moments(model: Linearization, noise: Noise, scales: Array) -> tuple[Array, Array, Array]:
    """The information (6, 6), and what noise of the encoders adds to it (6, 6) and to the score (6,).

    The components of a displacement are weighted alone. If the reference is exact, their covariance is nearly
    singular, and small changes of the wheel angles would change the weights.
    """
    present = ~model.is_absent
    variances = np.diagonal(covariances(model, noise), axis1=1, axis2=2)
    weights = np.where(present, 1.0 / variances, 0.0)
    slopes = model.derivatives
    information = np.einsum("mij,mi,mik->jk", slopes, weights, slopes) * np.outer(scales, scales)
    from_noise, score = np.zeros((COUNT, COUNT)), np.zeros(COUNT)
    for wheel, radius in ((0, LEFT), (1, RIGHT)):
        angles = model.motions.wheel_angles.copy()
        angles[:, wheel] *= 1.0 + _STEP
        stepped = Linearization.at(model.parameters, replace(model.motions, wheel_angles=angles))
        change = stepped.derivatives
        change -= model.derivatives  # in place: these are the largest arrays
        change *= scales / _STEP
        effect = model.derivatives[:, :, radius] * model.parameters[radius]
        scaled = weights * noise.slip_variances(model.travels[:, wheel])[:, None]
        from_noise += np.einsum("mij,mi,mik->jk", change, scaled, change)
        score += np.einsum("mij,mi,mi->j", change, scaled, effect)
    return information, from_noise, score
