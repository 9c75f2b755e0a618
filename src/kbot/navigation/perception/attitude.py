"""Finds from an accelerometer whether a robot has fallen over."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from kbot.sim.motion_watch import UPRIGHT

_SMOOTHING = 0.3
"""s. Time constant of the mean acceleration. Shocks and braking do not last as long."""


class Attitude:
    """The direction of gravity in the base's frame, as an accelerometer on it measures it."""

    def __init__(self, base_from_sensor: NDArray[np.float64]) -> None:
        """`base_from_sensor` is a rotation, a (3, 3) matrix."""
        self._base_from_sensor = base_from_sensor
        self._force: NDArray[np.float64] | None = None
        self._time = 0.0

    def forget(self) -> None:
        """Begin again, because the robot was placed elsewhere."""
        self._force = None

    def add(self, time: float, force: tuple[float, float, float]) -> None:
        """Process a specific force in m/s^2 in the sensor's axes."""
        measured = self._base_from_sensor @ force
        if self._force is None:
            self._force = measured
        else:
            share = min(1.0, max(0.0, time - self._time) / _SMOOTHING)
            self._force = self._force + share * (measured - self._force)
        self._time = time

    def describe_fall(self) -> str:
        """How the robot lies if it has fallen over; empty for a robot on its wheels."""
        if self._force is None:
            return ""
        size = float(np.linalg.norm(self._force))
        up = float(self._force[2]) / size if size > 0.0 else 1.0
        if up >= UPRIGHT:
            return ""
        tilt = round(math.degrees(math.acos(max(-1.0, up))))
        where = "back" if up < -UPRIGHT else "side"
        return f"the robot lies on its {where}: its IMU measures a tilt of {tilt}°"
