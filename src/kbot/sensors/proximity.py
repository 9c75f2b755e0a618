"""Sonar and infrared sensors: the nearest distance within a cone."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

from kbot.messages import sensing as msg
from kbot.messages.sensing import INFRARED, ULTRASOUND
from kbot.sensors.noise import NONE, Noise
from kbot.sensors.rays import Rays, within
from kbot.sensors.sensor import Sensor, Spec
from kbot.sim import Simulation
from kbot.text import KbotError

_RINGS, _SPOKES = 4, 12
"""A cone is sampled by its axis and by 4 rings of 12 rays."""


@dataclass(frozen=True, kw_only=True, repr=False)
class Range(Spec):
    """The distance to the nearest object within a cone of `field_of_view` rad about x.

    `range_min` and `range_max` are in m. `infrared` only sets the radiation type in the message.
    """

    kind: ClassVar[str] = "range"
    field_of_view: float = 0.26
    range_min: float = 0.02
    range_max: float = 4.0
    infrared: bool = False
    noise: Noise = NONE

    def __post_init__(self) -> None:
        super().__post_init__()
        if not 0.0 <= self.field_of_view < math.pi:
            raise KbotError(
                f"{self.label}: field_of_view must be at least 0 and below pi rad, not {self.field_of_view}"
            )
        if not 0.0 <= self.range_min < self.range_max < math.inf:
            raise KbotError(
                f"{self.label}: the minimum range must be at least 0 m and below the maximum range,"
                f" not {self.range_min} to {self.range_max} m"
            )

    def mount(self, simulation: Simulation) -> RangeSensor:
        return RangeSensor(simulation, self)


class RangeSensor(Sensor[msg.Range]):
    """Publishes a Range."""

    message_type = msg.Range
    spec: Range

    def __init__(self, simulation: Simulation, spec: Range) -> None:
        super().__init__(simulation, spec)
        self._rays = Rays(self.owner, cone(spec.field_of_view))
        self._noise = self._noise_of(spec.noise, "range", 1)

    def measure(self, sample: int | None = None) -> msg.Range:
        spec = self.spec
        distance = self._rays.cast(*self._place(), spec.range_max).min(keepdims=True)
        value = within(distance, spec.range_min, spec.range_max)
        if sample is not None and np.isfinite(value[0]):
            value = np.clip(self._noise.apply(value, sample), spec.range_min, spec.range_max)
        kind = INFRARED if spec.infrared else ULTRASOUND
        return msg.Range(
            self._header(), kind, spec.field_of_view, spec.range_min, spec.range_max, float(value[0]),
            spec.noise.variance,
        )  # fmt: skip


def cone(angle: float) -> NDArray[np.float64]:
    """Directions (n, 3) that fill a cone of this full angle (rad) about x, including its edge."""
    off = np.linspace(0.0, angle / 2.0, _RINGS + 1)[1:, None]
    around = np.arange(_SPOKES) * (2.0 * math.pi / _SPOKES)
    parts = (np.cos(off) + 0.0 * around, np.sin(off) * np.cos(around), np.sin(off) * np.sin(around))
    rings = np.stack(parts, axis=-1).reshape(-1, 3)
    return np.concatenate([[[1.0, 0.0, 0.0]], rings])
