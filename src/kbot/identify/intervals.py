"""95 % intervals of least-squares estimates that hold if the noise is not quite as modelled.

The variance of an estimate is computed from the residuals themselves, by the equal-weighted cosine estimator
(E. Lazarus, D. Lewis, J. Stock and M. Watson, HAR Inference: Recommendations for Practice, Journal of
Business and Economic Statistics 36(4), 2018). It is consistent if the noise differs between intervals and is
correlated in time. Its bias and its degrees of freedom in a short log are corrected as by R. Bell and
D. McCaffrey (Bias Reduction in Standard Errors for Linear Regression with Multi-Stage Samples, Survey
Methodology 28(2), 2002).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.stats import t as student

from kbot.identify.log import Array

LEVEL = 0.95
DEVIATION_OF_MAD = 1.4826
"""Standard deviation of Gaussian noise, divided by the median of its absolute value."""
_MOST_COSINES = 40
"""With 40 degrees of freedom an interval is 3 % wider than with infinitely many."""
_BLOCK = 50_000
"""Times whose waves are in memory together."""
_FEWEST_COSINES = 4
"""For a short log. With fewer degrees of freedom, an interval is too wide to be of use."""


def half_widths(derivatives: Array, residuals: Array, contrasts: Array, group: int) -> Array:
    """Half the width of the 95 % interval of each linear combination of the parameters.

    Args:
        derivatives: (n, p) whitened derivatives of the predictions, of full rank, in the order of time.
        residuals: (n,) whitened residuals at the estimate.
        contrasts: (k, p) the combinations.
        group: rows that belong to one time.
    """
    orthogonal, triangle = np.linalg.qr(derivatives)
    count = len(residuals) // group
    cosines = int(np.clip(round(0.4 * count ** (2.0 / 3.0)), _FEWEST_COSINES, _MOST_COSINES))
    cosines = min(cosines, count)
    harmonics = np.arange(1, cosines + 1)
    influences = [orthogonal @ np.linalg.solve(triangle.T, contrast) for contrast in contrasts]
    sums = [_Sums.of(cosines, orthogonal.shape[1]) for _ in contrasts]
    for begin in range(0, count, _BLOCK):  # blocks, because the waves are larger than the derivatives
        phase = np.pi * (np.arange(begin, min(begin + _BLOCK, count)) + 0.5) / count
        waves = np.sqrt(2.0) * np.cos(np.outer(phase, harmonics))
        rows = slice(begin * group, (begin + len(phase)) * group)
        for influence, each in zip(influences, sums, strict=True):
            # the rows of one time have the same waves, so their sums need a fraction of the memory
            each.measured += _by_time(residuals[rows] * influence[rows], group) @ waves
            each.inside += _by_time(orthogonal[rows] * influence[rows, None], group).T @ waves
            each.expected += waves.T @ (waves * _by_time(influence[rows] ** 2, group)[:, None])
    widths = np.empty(len(contrasts))
    for index, (influence, each) in enumerate(zip(influences, sums, strict=True)):
        measured = float((each.measured**2).sum())
        # of `measured`, if the residuals were white
        expected = each.expected - each.inside.T @ each.inside
        total = float(np.trace(expected))
        freedom = max(total**2 / float((expected**2).sum()), 1.0)
        variance = float(influence @ influence) * measured / total
        widths[index] = student.ppf(0.5 + LEVEL / 2.0, freedom) * np.sqrt(variance)
    return widths


@dataclass(slots=True)
class _Sums:
    """Sums over time of products with k waves, for one combination of p parameters.

    measured  (k,) of the residuals times their influence
    inside    (p, k) of the orthogonal derivatives times the influence
    expected  (k, k) of the squared influence times the products of two waves
    """

    measured: Array
    inside: Array
    expected: Array

    @classmethod
    def of(cls, cosines: int, parameters: int) -> _Sums:
        return cls(np.zeros(cosines), np.zeros((parameters, cosines)), np.zeros((cosines, cosines)))


def _by_time(values: Array, group: int) -> Array:
    """The sums over the rows of each time."""
    found: Array = values.reshape(-1, group, *values.shape[1:]).sum(axis=1)
    return found
