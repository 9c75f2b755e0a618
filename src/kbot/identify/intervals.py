"""95 % intervals of least-squares estimates that hold if the noise is not quite as modelled.

The variance of an estimate is computed from the residuals themselves, by the equal-weighted cosine estimator
(E. Lazarus, D. Lewis, J. Stock and M. Watson, HAR Inference: Recommendations for Practice, Journal of
Business and Economic Statistics 36(4), 2018). It is consistent if the noise differs between intervals and is
correlated in time. Its bias and its degrees of freedom in a short log are corrected as by R. Bell and
D. McCaffrey (Bias Reduction in Standard Errors for Linear Regression with Multi-Stage Samples, Survey
Methodology 28(2), 2002).
"""

from __future__ import annotations

import numpy as np
from scipy.stats import t as student

from kbot.identify.log import Array

LEVEL = 0.95
DEVIATION_OF_MAD = 1.4826
"""Standard deviation of Gaussian noise, divided by the median of its absolute value."""
_MOST_COSINES = 40
"""With 40 degrees of freedom an interval is 3 % wider than with infinitely many."""
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
    phase = np.pi * (np.arange(count) + 0.5) / count
    waves = np.sqrt(2.0) * np.cos(np.outer(phase, np.arange(1, cosines + 1)))
    widths = np.empty(len(contrasts))
    for index, contrast in enumerate(contrasts):
        influence = orthogonal @ np.linalg.solve(triangle.T, contrast)
        # the rows of one time have the same waves, so their sums need a fraction of the memory
        measured = float(((_by_time(residuals * influence, group) @ waves) ** 2).sum())
        inside = _by_time(orthogonal * influence[:, None], group).T @ waves
        # of `measured`, if the residuals were white
        expected = waves.T @ (waves * _by_time(influence**2, group)[:, None]) - inside.T @ inside
        total = float(np.trace(expected))
        freedom = max(total**2 / float((expected**2).sum()), 1.0)
        variance = float(influence @ influence) * measured / total
        widths[index] = student.ppf(0.5 + LEVEL / 2.0, freedom) * np.sqrt(variance)
    return widths


def _by_time(values: Array, group: int) -> Array:
    """The sums over the rows of each time."""
    found: Array = values.reshape(-1, group, *values.shape[1:]).sum(axis=1)
    return found
