"""The result of an identification: estimates with intervals, and what the log cannot show."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from kbot.text.columns import aligned

LEFT_RADIUS, RIGHT_RADIUS, WHEEL_SEPARATION = "left_wheel_radius", "right_wheel_radius", "wheel_separation"
SENSOR_POSE = SENSOR_X, SENSOR_Y, SENSOR_YAW = "sensor_x", "sensor_y", "sensor_yaw"
SCHEMA = 1
"""Version of the JSON of `kbot identify`."""
_MANY = 0.2
"""Share of disturbed displacements above which slip and failed scan matching are not the likely cause."""
_MOST_DECIMALS = 6
"""A micrometre, or a microradian."""

NO_RESULT: dict[str, Any] = {
    "schema": SCHEMA,
    "parameters": {},
    "unobservable": [],
    "residual": {},
    "sources": {},
}
"""The JSON after an error."""


@dataclass(frozen=True, slots=True)
class Estimate:
    """The value of a parameter, its 95 % interval, and the description's value, None if it has none."""

    value: float
    low: float
    high: float
    unit: str
    nominal: float | None

    @property
    def decimals(self) -> int:
        """Decimal places that show two digits of the interval's width, down to a micrometre."""
        width = self.high - self.low
        return next(
            (digits for digits in range(1, _MOST_DECIMALS) if width * 10.0**digits >= 10.0), _MOST_DECIMALS
        )

    def to_json(self) -> dict[str, Any]:
        return {
            "value": self.value + 0.0,  # without the sign of a zero
            "unit": self.unit,
            "low": self.low + 0.0,
            "high": self.high + 0.0,
            "nominal": self.nominal,
        }


@dataclass(frozen=True, slots=True)
class Residual:
    """How well the estimate predicts the reference, without outliers, and how well the description did.

    intervals, outliers    numbers of displacements of the reference that are used and left out
    translation, rotation  root mean square of the errors, in m and rad; None if the reference has none
    nominal_translation, nominal_rotation  the same with the description's values
    wheel_speed            root mean square of the errors in rad/s of the wheel speeds that the commands and
                           the fitted response predict; None if the log does not show the response
    """

    intervals: int
    outliers: int
    translation: float | None
    rotation: float | None
    nominal_translation: float | None
    nominal_rotation: float | None
    wheel_speed: float | None


@dataclass(frozen=True, slots=True)
class Identification:
    """The estimates by name, and the parameters that the log cannot show with what would show them.

    `is_disturbed` (M,) marks the displacements of the log's `Motions` in which the robot slipped or
    collided, or the reference failed: outliers with large errors. `sources` are the topics from which the log
    was read, and the link of the sensor.
    """

    parameters: Mapping[str, Estimate]
    unobservable: Mapping[str, str]
    residual: Residual
    is_disturbed: NDArray[np.bool_]
    sources: Mapping[str, str]

    def to_json(self) -> dict[str, Any]:
        residual = self.residual
        return {
            "schema": SCHEMA,
            "parameters": {name: estimate.to_json() for name, estimate in self.parameters.items()},
            "unobservable": list(self.unobservable),
            "residual": {
                "intervals": residual.intervals,
                "outliers": residual.outliers,
                "translation": residual.translation,
                "rotation": residual.rotation,
                "nominal_translation": residual.nominal_translation,
                "nominal_rotation": residual.nominal_rotation,
                "wheel_speed": residual.wheel_speed,
            },
            "sources": dict(self.sources),
        }

    def to_text(self) -> str:
        rows = [("parameter", "value", "95 % interval", "in the file", "")]
        for name, estimate in self.parameters.items():
            digits = estimate.decimals
            nominal = "" if estimate.nominal is None else _number(estimate.nominal, digits)
            interval = f"{_number(estimate.low, digits)} to {_number(estimate.high, digits)}"
            rows.append((name, _number(estimate.value, digits), interval, nominal, estimate.unit))
        lines = aligned(rows, left=(0, 4))
        if self.unobservable:
            lines.append("")
            lines.append("The log does not show:")
            width = max(map(len, self.unobservable))
            lines += [f"  {name:<{width}}  {reason}" for name, reason in self.unobservable.items()]
        residual = self.residual
        outliers = f"{residual.outliers} outlier{'' if residual.outliers == 1 else 's'} left out"
        if residual.outliers and not self.is_disturbed.any():
            outliers += ", all with negligible errors"
        elif self.is_disturbed.mean() > _MANY:
            outliers += ", more than a fifth: check the reference and the units"
        lines += ["", f"{residual.intervals} intervals used, {outliers}"]
        for what, after, before, unit in (
            ("translation", residual.translation, residual.nominal_translation, "m"),
            ("rotation", residual.rotation, residual.nominal_rotation, "rad"),
        ):
            if after is not None:
                compared = "" if before is None else f" (with the file: {before:.3g} {unit})"
                lines.append(f"error of {what} in an interval: {after:.3g} {unit}{compared}")
        if residual.wheel_speed is not None:
            lines.append(f"error of the wheel speeds after commands: {residual.wheel_speed:.3g} rad/s")
        if self.sources:
            lines.append("sources: " + ", ".join(f"{name} {source}" for name, source in self.sources.items()))
        return "\n".join(lines)


def _number(value: float, digits: int) -> str:
    """A number without the sign of a rounded zero."""
    return f"{round(value, digits) + 0.0:.{digits}f}"
