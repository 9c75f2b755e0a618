"""The displacement of a sensor that wheel speeds and the parameters of a robot predict.

Source of the model: A. Censi, A. Franchi, L. Marchionni and G. Oriolo, Simultaneous Calibration of Odometry
and Sensor Parameters for Mobile Robots, IEEE Transactions on Robotics 29(2), 2013.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from kbot.identify.log import Array, Motions
from kbot.kinematics.angles import wrap_all

LEFT, RIGHT, CURVATURE, X, Y, YAW = range(6)
"""The parameters: radii of the left and right wheel in m, the inverse of the wheel separation in 1/m, and the
pose of the sensor in the frame at the middle of the axle in m, m and rad.

The inverse of the separation is used because it is bounded: it is 0 if the turns of a log are only noise."""
COUNT = 6
_STEP = 1e-20
"""Imaginary step of derivatives. The complex step has no rounding error, so that it may be this small."""

Complex = NDArray[np.complex128]


def predicted(parameters: Array | Complex, motions: Motions) -> Array | Complex:
    """(M, 3) displacements of the sensor in m, m and rad. Wheel speeds are constant in an interval."""
    left, right = (
        motions.wheel_angles[:, 0] * parameters[LEFT],
        motions.wheel_angles[:, 1] * parameters[RIGHT],
    )
    length, turn = (left + right) / 2.0, (right - left) * parameters[CURVATURE]
    heading = np.cumsum(turn)
    half = turn / 2.0
    is_small = np.abs(half) < 1e-4
    # sin(half)/half, from its series for small angles, where the quotient loses digits
    sinc = np.where(is_small, 1.0 - half * half / 6.0, np.sin(half) / np.where(is_small, 1.0, half))
    chord, direction = length * sinc, heading - half
    x, y, yaw = (
        np.concatenate([[0.0], sums])
        for sums in (np.cumsum(chord * np.cos(direction)), np.cumsum(chord * np.sin(direction)), heading)
    )
    start, stop = motions.start, motions.stop
    moved_x, moved_y = _turned(x[stop] - x[start], y[stop] - y[start], -yaw[start])
    turned = yaw[stop] - yaw[start]
    lever_x, lever_y = _turned(parameters[X], parameters[Y], turned)
    ahead, aside = moved_x + lever_x - parameters[X], moved_y + lever_y - parameters[Y]
    result: Array | Complex = np.column_stack([*_turned(ahead, aside, -parameters[YAW]), turned])
    return result


def _turned(x: Array, y: Array, angle: Array) -> tuple[Array, Array]:
    cos, sin = np.cos(angle), np.sin(angle)
    return cos * x - sin * y, sin * x + cos * y


def residuals(parameters: Array, motions: Motions) -> Array:
    """(M, 3) measured minus predicted displacements; NaN where a component is absent."""
    return _errors(np.real(predicted(parameters, motions)), motions)


def _errors(predictions: Array, motions: Motions) -> Array:
    errors = motions.displacements - predictions
    errors[:, 2] = wrap_all(errors[:, 2])
    return errors


@dataclass(frozen=True, slots=True)
class Linearization:
    """The model of M displacements near one estimate of the parameters.

    parameters   (6,)
    motions      the measured displacements
    predictions  (M, 3) predicted displacements in m, m and rad
    residuals    (M, 3) measured minus predicted displacements; NaN where a component is absent
    derivatives  (M, 3, 6) of the predictions by the parameters
    """

    parameters: Array
    motions: Motions
    predictions: Array
    residuals: Array
    derivatives: Array

    @classmethod
    def at(cls, parameters: Array, motions: Motions) -> Linearization:
        predictions, slopes = np.empty((len(motions), 3)), np.empty((len(motions), 3, COUNT))
        for index in range(COUNT):
            stepped = parameters.astype(complex)
            stepped[index] += 1j * _STEP
            column = predicted(stepped, motions)
            predictions[:] = np.real(column)
            slopes[:, :, index] = np.imag(column) / _STEP
        return cls(parameters, motions, predictions, _errors(predictions, motions), slopes)

    def only(self, kept: NDArray[np.bool_] | slice) -> Linearization:
        return Linearization(
            self.parameters,
            self.motions.only(kept),
            self.predictions[kept],
            self.residuals[kept],
            self.derivatives[kept],
        )

    @property
    def is_absent(self) -> NDArray[np.bool_]:
        """(M, 3) the components that the reference does not have."""
        return np.isnan(self.residuals)

    @property
    def travels(self) -> Array:
        """(M, 2) the distance in m that each wheel rolls."""
        rolled: Array = self.motions.travels() * np.abs(self.parameters[[LEFT, RIGHT]])
        return rolled
