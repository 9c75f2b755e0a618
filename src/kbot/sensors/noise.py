"""Sensor noise: white noise, and a bias that is constant or drifts.

The model is Gazebo's GaussianNoiseModel. A drifting bias follows the Ornstein-Uhlenbeck process. Without a
correlation time it is a random walk, whose standard deviation is `walk` times the square root of time.
"""

from __future__ import annotations

import hashlib
import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from kbot.text import KbotError

Values = NDArray[np.float64]

LARGEST = 1e100
"""Largest parameter of a noise: its square is still a finite number."""


@dataclass(frozen=True, slots=True)
class Noise:
    """The noise of a measured value, in that value's unit.

    `mean` and `stddev` describe the white noise of each value. The bias is drawn once, from `bias_mean` and
    `bias_stddev`. Then it drifts by `walk` (unit per square root of a second) and returns to its first value
    with the time constant `correlation_time` (s). With a `precision`, values are rounded to multiples of it.
    """

    stddev: float = 0.0
    mean: float = 0.0
    bias_mean: float = 0.0
    bias_stddev: float = 0.0
    walk: float = 0.0
    correlation_time: float = math.inf
    precision: float = 0.0

    def __post_init__(self) -> None:
        deviations = (self.stddev, self.bias_stddev, self.walk, self.precision)
        if not all(abs(v) <= LARGEST for v in (*deviations, self.mean, self.bias_mean)):
            raise KbotError(f"the noise parameters must be finite numbers up to {LARGEST:g}")
        if min(deviations) < 0.0 or not self.correlation_time > 0.0:
            raise KbotError(
                "the noise deviations and precision must be at least 0, and the correlation time above 0"
            )

    @property
    def is_none(self) -> bool:
        return not any((self.stddev, self.mean, self.bias_mean, self.bias_stddev, self.walk, self.precision))

    @property
    def variance(self) -> float:
        """The variance of one value about its bias."""
        return self.stddev**2


NONE = Noise()


class NoiseSource:
    """The noise of one sensor's values. It depends only on the seed, the sensor's name and the sample."""

    def __init__(self, noise: Noise, seed: int, name: str, count: int, period: float) -> None:
        """Noise for `count` values per sample, with one sample every `period` seconds."""
        self.noise = noise
        self._count = count
        digest = hashlib.sha256(f"{seed}/{name}".encode()).digest()
        self._key = int.from_bytes(digest[:16], "little")
        bias = self._random(0, 0).standard_normal(count)
        self._first: Values = noise.bias_mean + noise.bias_stddev * bias
        self._bias, self._at = self._first, 0
        dt, tau = period, noise.correlation_time
        self._keep = math.exp(-dt / tau)
        # a step adds the variance walk^2 tau/2 (1 - exp(-2 dt/tau)), which tends to walk^2 dt for infinite
        # tau
        spread = dt if math.isinf(tau) else -tau / 2.0 * math.expm1(-2.0 * dt / tau)
        self._step = noise.walk * math.sqrt(spread)

    def apply(self, values: Values, sample: int) -> Values:
        """Add noise to the values (count,) of sample number `sample`."""
        noise = self.noise
        if noise.is_none:
            return values
        noisy = values + self.bias(sample)
        if noise.stddev:
            noisy = noisy + noise.stddev * self._random(sample, 1).standard_normal(self._count)
        noisy = noisy + noise.mean
        return np.round(noisy / noise.precision) * noise.precision if noise.precision else noisy

    def bias(self, sample: int) -> Values:
        """The bias (count,) at a sample, computed step by step from the last requested sample."""
        if not self._step:
            return self._first
        if sample < self._at:
            self._bias, self._at = self._first, 0
        while self._at < sample:
            self._at += 1
            drawn = self._random(self._at, 2).standard_normal(self._count)
            self._bias = self._first + self._keep * (self._bias - self._first) + self._step * drawn
        return self._bias

    def _random(self, sample: int, stream: int) -> np.random.Generator:
        return np.random.Generator(np.random.Philox(key=self._key, counter=[0, stream, sample, 0]))
