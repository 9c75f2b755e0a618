"""Wraps angles. All of KBot wraps a yaw to the same interval: above -pi, and at most pi.

That is the interval of `angles::normalize_angle` of ROS, which maps -pi and pi to pi (github.com/ros/angles,
angles.h). Yaws that are computed with `atan2`, as those of quaternions, lie in it too, apart from -pi itself.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

FULL_TURN = 2.0 * math.pi


def wrap(angle: float) -> float:
    """The same angle in rad, above -pi and at most pi. An angle that is there already is not changed."""
    if not math.isfinite(angle):  # of a simulation that has diverged
        return math.nan
    wrapped = math.remainder(angle, FULL_TURN)
    return math.pi if wrapped == -math.pi else wrapped


def wrap_all(angles: NDArray[np.float64]) -> NDArray[np.float64]:
    """`wrap` for each angle of an array, with the same results."""
    # fmod and the sums are exact, so that angles that are wrapped already keep all digits
    turned = np.fmod(angles, FULL_TURN)
    turned = np.where(turned > math.pi, turned - FULL_TURN, turned)
    wrapped: NDArray[np.float64] = np.where(turned <= -math.pi, turned + FULL_TURN, turned)
    return wrapped
