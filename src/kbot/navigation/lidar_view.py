"""What a level lidar sees of a robot's surroundings: directions and range."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

_ALMOST = math.radians(2.0)
"""A lidar of 360 beams spans a degree less than a full turn."""


@dataclass(frozen=True, slots=True)
class LidarView:
    """The directions and the range in which a lidar sees.

    start  the first direction in rad in the base's frame
    end    the last one, counter-clockwise
    reach  the range in m
    """

    start: float
    end: float
    reach: float

    @property
    def is_full(self) -> bool:
        """Whether the lidar sees in every direction."""
        return self.end - self.start >= 2.0 * math.pi

    @classmethod
    def of_beams(
        cls, angle_min: float, angle_max: float, range_max: float, base_from_sensor: NDArray[np.float64]
    ) -> LidarView:
        """The view of beams between two angles of the sensor, whose pose is a (4, 4) matrix."""
        low, high = sorted((angle_min, angle_max))
        if not (math.isfinite(low) and math.isfinite(high)):
            return cls(math.nan, math.nan, range_max)
        if base_from_sensor[2, 2] < 0.0:
            low, high = -high, -low  # it is mounted upside down
        if high - low >= 2.0 * math.pi - _ALMOST:
            return cls(-math.pi, math.pi, range_max)
        turn = math.atan2(base_from_sensor[1, 0], base_from_sensor[0, 0])
        start = math.remainder(low + turn, 2.0 * math.pi)
        return cls(start, start + high - low, range_max)
