"""Reads values within a `<sensor>`: numbers, texts, poses and noise. Errors are reported at their line."""

from __future__ import annotations

import math

from kbot.kinematics.transform import Transform
from kbot.sensors.noise import NONE, Noise
from kbot.text import Diagnostic, Element, KbotError, Origin, Severity
from kbot.text.numbers import to_float


class SensorValues:
    """Reads values below one element by paths such as `ray/scan/horizontal/samples`, and collects errors."""

    def __init__(self, element: Element, diagnostics: list[Diagnostic]) -> None:
        self.element, self.diagnostics = element, diagnostics

    def find(self, *paths: str) -> Element | None:
        """The element of the first path that exists."""
        for path in paths:
            at: Element | None = self.element
            for tag in path.split("/"):
                at = at.find(tag) if at is not None else None
            if at is not None:
                return at
        return None

    def text(self, *paths: str) -> str:
        """The text of the first path that exists, else empty."""
        found = self.find(*paths)
        return found.text.strip() if found is not None else ""

    def number(self, default: float, *paths: str) -> float:
        found = self.find(*paths)
        return default if found is None else self._number(found, default)

    def whole(self, default: int, *paths: str) -> int:
        return round(self.number(default, *paths))

    def word(self, default: str, known: tuple[str, ...], *paths: str) -> str:
        """One of the words `known`."""
        found = self.find(*paths)
        if found is None:
            return default
        word = found.text.strip()
        if word not in known:
            self.error(f"<{found.tag}> must be one of {', '.join(known)}, not '{word}'", found)
            return default
        return word

    def pose(self) -> Transform:
        """`<pose>`: x y z roll pitch yaw in the link's frame."""
        found = self.find("pose")
        if found is None:
            return Transform.identity()
        degrees = found.attributes.get("degrees", "").strip() in ("true", "1")
        try:
            x, y, z, *rpy = (to_float(word) for word in found.text.split())
            if len(rpy) != 3:
                raise ValueError
            return Transform.from_xyz_rpy((x, y, z), [math.radians(v) if degrees else v for v in rpy])
        except ValueError:
            self.error(
                f"a pose must be six finite numbers x y z roll pitch yaw, not '{found.text.strip()}'", found
            )
            return Transform.identity()

    def noise(self, *paths: str) -> Noise:
        """An SDFormat `<noise>`. `NONE` if it is missing or of the type none."""
        found = self.find(*paths)
        if found is None:
            return NONE
        inner = SensorValues(found, self.diagnostics)
        kind = found.attributes.get("type") or inner.text("type") or "gaussian"
        if kind == "none":
            return NONE
        if kind not in ("gaussian", "gaussian_quantized"):
            self.warn(f"the noise type '{kind}' is not simulated: use gaussian or gaussian_quantized", found)
            return NONE
        time = inner.number(0.0, "dynamic_bias_correlation_time")
        try:
            return Noise(
                stddev=inner.number(0.0, "stddev"),
                mean=inner.number(0.0, "mean"),
                bias_mean=inner.number(0.0, "bias_mean"),
                bias_stddev=inner.number(0.0, "bias_stddev"),
                walk=inner.number(0.0, "dynamic_bias_stddev"),
                correlation_time=time if time > 0.0 else math.inf,
                precision=inner.number(0.0, "precision") if kind == "gaussian_quantized" else 0.0,
            )
        except KbotError as error:
            self.error(str(error), found)
            return NONE

    def error(self, message: str, where: Element | Origin) -> None:
        self._add("W141", Severity.ERROR, message, where)

    def warn(self, message: str, where: Element | Origin) -> None:
        self._add("W140", Severity.WARNING, message, where)

    def inform(self, message: str, where: Element, hint: str) -> None:
        self._add("W140", Severity.INFO, message, where, hint)

    def _number(self, element: Element, default: float) -> float:
        try:
            value = to_float(element.text)
        except ValueError:
            value = math.nan
        if value == math.inf and element.tag in ("max", "far"):
            return 1e6  # far beyond any world; the ranges of a sensor must be finite
        if not math.isfinite(value):
            self.error(f"<{element.tag}> must be a finite number, not '{element.text.strip()}'", element)
            return default
        return value

    def _add(
        self, code: str, severity: Severity, message: str, where: Element | Origin, hint: str = ""
    ) -> None:
        name = self.element.attributes.get("name") or self.element.tag
        origin = where.origin if isinstance(where, Element) else where
        self.diagnostics.append(Diagnostic(code, severity, f"{name}: {message}", origin, hint))
