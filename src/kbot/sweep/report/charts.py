"""The charts of a sweep as SVG, in the colours of the page that contains them."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass

from kbot.render.plot import round_ticks
from kbot.sweep.space import Choices, Dimension, Levels, Value
from kbot.text.xml_text import escaped

_FONT = 'font-family="sans-serif" font-size="12" fill="currentColor"'
_LETTER = 7
"""Width of a letter in pixels."""
_LONGEST = 28
"""Characters of a label. A stranger's world may have any name."""
_LONGEST_LABEL = 21
"""Characters of the label of one of many parallel axes: a longer one would cover that of the next axis."""
_LINE = 15
"""Height of a line of text in pixels."""
_FEW = 12
"""Values of a range that has a tick at each. More have ticks at round numbers."""
_MOST_TEXTS = 30
"""Ticks of an axis of texts. More would cover each other."""


@dataclass(frozen=True, slots=True)
class Axis:
    """An axis of numbers, or of texts.

    label       with the unit
    hint        names the better end
    texts       all values of an axis of texts
    values      the only values, if they are few
    is_integer  whether all values are integers
    """

    label: str
    low: float
    high: float
    hint: str = ""
    texts: tuple[str, ...] = ()
    values: tuple[float, ...] = ()
    is_integer: bool = False

    def at(self, value: Value) -> float:
        """The place of a value, from 0 to 1."""
        number = self.texts.index(value) if isinstance(value, str) else value
        return (float(number) - self.low) / (self.high - self.low)

    def ticks(self, most: float, room: Callable[[str], float]) -> list[tuple[float, str]]:
        """Places and texts: at most about `most` round numbers, or the values if they are few.

        `room` is the share of the axis that a text needs. A value without room has no tick.
        """
        if self.texts:
            return [(self.at(text), shortened(text)) for text in self.texts[:_MOST_TEXTS]]
        if not self.values:
            found = [each for each in round_ticks(self.low, self.high, most) if not self._is_between(each)]
            return [(self.at(each), f"{each:.12g}") for each in found]
        ticks: list[tuple[float, str]] = []
        for value in self.values:
            place, text = self.at(value), f"{value:.0f}" if self.is_integer else f"{value:.6g}"
            has_room = not ticks or place - ticks[-1][0] >= (room(text) + room(ticks[-1][1])) / 2
            if has_room and 0.0 <= place <= 1.0:
                ticks.append((place, text))
        return ticks

    def _is_between(self, tick: float) -> bool:
        """Whether a number is between two integers, which are the only values."""
        return self.is_integer and not tick.is_integer()


def axis(label: str, values: Sequence[Value], dimension: Dimension | None = None, hint: str = "") -> Axis:
    """The axis of some values of a dimension or of a measure. The label includes the unit."""
    domain = dimension.domain if dimension is not None else None
    listed: list[Value] = []
    if isinstance(domain, Choices):
        listed = domain.samples()
    elif isinstance(domain, Levels) and domain.count <= _FEW:
        listed = [domain.nth(index) for index in range(domain.count)]
    texts = tuple(value for value in listed if isinstance(value, str))
    if texts:
        return Axis(label, -0.5, len(texts) - 0.5, hint, texts)
    few = tuple(sorted(float(value) for value in listed))
    is_integer = dimension is not None and dimension.kind is int
    numbers = [float(value) for value in values if math.isfinite(float(value))] or [0.0]
    low, high = min(numbers), max(numbers)
    margin = 0.05 * (high - low) or 0.1 * abs(low) or 0.5
    return Axis(label, low - margin, high + margin, hint, values=few, is_integer=is_integer)


@dataclass(frozen=True, slots=True)
class Mark:
    """A design in a chart: a line in parallel coordinates, or a point of a scatter plot.

    values    one for each axis
    title     what the mouse shows
    shade     from 0 to 1, for the colour: 0 is the best
    kind      "best", "passed" or "failed"
    label     is written beside a point
    """

    values: tuple[Value, ...]
    title: str
    shade: float = 0.0
    kind: str = "passed"
    label: str = ""


_ORDER = {"failed": 0, "passed": 1, "best": 2}
"""The order in which designs are drawn: the last ones are above the others."""


def shortened(text: str) -> str:
    """A text of at most `_LONGEST` characters."""
    return text if len(text) <= _LONGEST else f"{text[: _LONGEST - 1]}…"


def _end_of(label: str) -> str:
    """The end of a label, which has the last part of a path and the unit, between the axes beside it."""
    return label if len(label) <= _LONGEST_LABEL else f"…{label[1 - _LONGEST_LABEL :]}"


def _colour(mark: Mark) -> str:
    if mark.kind == "failed":
        return "var(--error)"
    # the better, the more of the first colour: both are distinct for colour-blind readers
    return f"color-mix(in oklab, var(--plot-2) {100 * mark.shade:.0f}%, var(--plot-1))"


def parallel_svg(axes: Sequence[Axis], lines: Sequence[Mark]) -> str:
    """Parallel coordinates: an axis for each dimension and objective, and a line for each design."""
    width, height, top, bottom = max(520, 150 * len(axes)), 380, 52, 22
    left = 64
    step = (width - left - 84) / max(1, len(axes) - 1)
    inner = height - top - bottom

    def y(number: int, value: Value) -> float:
        return top + (1.0 - axes[number].at(value)) * inner

    parts = [_head(width, height, "Parallel coordinates: one line for each design")]
    for line in sorted(lines, key=lambda line: (_ORDER[line.kind], -line.shade)):
        path = "".join(
            f"{'L' if number else 'M'}{left + number * step:.1f} {y(number, value):.1f}"
            for number, value in enumerate(line.values)
        )
        is_best = line.kind == "best"
        parts.append(
            f'<path d="{path}" fill="none" stroke="{"var(--text)" if is_best else _colour(line)}"'
            f' stroke-width="{2.5 if is_best else 1.2}" stroke-opacity="{1 if is_best else 0.45}"'
            f' stroke-linejoin="round"><title>{escaped(line.title)}</title></path>'
        )
    for number, each in enumerate(axes):
        x = left + number * step
        anchor = "start" if number == 0 else "end" if number == len(axes) - 1 else "middle"
        at = x - 40 if number == 0 else x + 70 if number == len(axes) - 1 else x
        label = f'x="{at:.1f}" text-anchor="{anchor}"'
        parts.append(f'<text {label} y="18" font-weight="600">{escaped(_end_of(each.label))}</text>')
        parts.append(f'<text {label} y="34" fill="var(--quiet)">{escaped(each.hint)}</text>')
        parts.append(f'<path d="M{x:.1f} {top}v{inner}" stroke="var(--strong-line)" stroke-width="1.5"/>')
        for fraction, text in each.ticks(6, lambda _: _LINE / inner):
            tick = top + (1.0 - fraction) * inner
            parts.append(f'<path d="M{x:.1f} {tick:.1f}h6" stroke="var(--strong-line)"/>')
            parts.append(
                f'<text x="{x + 9:.1f}" y="{tick:.1f}" dy="0.35em" stroke="var(--panel)" stroke-width="3"'
                f' stroke-opacity="0.85" paint-order="stroke">{escaped(text)}</text>'
            )
    return "\n".join([*parts, "</svg>"])


def scatter_svg(
    x_axis: Axis, y_axis: Axis, points: Sequence[Mark], front: Sequence[tuple[float, float]] = ()
) -> str:
    """Points of designs, and the steps of the Pareto front through `front`."""
    width, height, top, right, bottom = 400, 270, 14, 16, 46
    inner_height = height - top - bottom
    y_ticks = y_axis.ticks(inner_height / 40, lambda _: _LINE / inner_height)
    left = 38 + _LETTER * max((len(text) for _, text in y_ticks), default=0)
    inner_width = width - left - right

    def place(values: Sequence[Value]) -> tuple[float, float]:
        return left + x_axis.at(values[0]) * inner_width, top + (1.0 - y_axis.at(values[1])) * inner_height

    parts = [_head(width, height, f"{y_axis.label} against {x_axis.label}")]
    for fraction, text in x_axis.ticks(
        inner_width / 70, lambda text: _LETTER * (len(text) + 1) / inner_width
    ):
        x = left + fraction * inner_width
        parts.append(f'<path stroke="var(--line)" d="M{x:.1f} {top}v{inner_height}"/>')
        parts.append(f'<text x="{x:.1f}" y="{height - 28}" text-anchor="middle">{escaped(text)}</text>')
    for fraction, text in y_ticks:
        y = top + (1.0 - fraction) * inner_height
        parts.append(f'<path stroke="var(--line)" d="M{left} {y:.1f}h{inner_width}"/>')
        parts.append(f'<text x="{left - 8}" y="{y:.1f}" dy="0.35em" text-anchor="end">{escaped(text)}</text>')
    middle, centre = left + inner_width / 2, top + inner_height / 2
    parts.append(
        f'<text x="{middle:.0f}" y="{height - 8}" text-anchor="middle">{escaped(x_axis.label)}</text>'
    )
    turned = f'transform="translate(14 {centre:.0f}) rotate(-90)" text-anchor="middle"'
    parts.append(f"<text {turned}>{escaped(y_axis.label)}</text>")
    if len(front) > 1:
        # between two designs of the front, none is known that is better than both
        places = [place(each) for each in sorted(front)]
        path = f"M{places[0][0]:.1f} {places[0][1]:.1f}" + "".join(f"L{x:.1f} {y:.1f}" for x, y in places[1:])
        parts.append(
            f'<path d="{path}" fill="none" stroke="var(--text)" stroke-width="1.2" stroke-dasharray="4 3"/>'
        )
    labels: list[tuple[float, float]] = []
    for point in sorted(points, key=lambda point: _ORDER[point.kind]):
        x, y = place(point.values)
        is_best = point.kind == "best"
        stroke = ' stroke="var(--text)" stroke-width="1.8"' if is_best else ""
        parts.append(
            f'<circle cx="{x:.1f}" cy="{y:.1f}" r="{5 if is_best else 3.2}" fill="{_colour(point)}"'
            f' fill-opacity="{1 if is_best else 0.6}"{stroke}><title>{escaped(point.title)}</title></circle>'
        )
        # two labels on each other cannot be read
        if point.label and not any(abs(x - at) < 18 and abs(y - height) < 12 for at, height in labels):
            labels.append((x, y))
            parts.append(
                f'<text x="{x + 7:.1f}" y="{y - 6:.1f}" font-size="11">{escaped(point.label)}</text>'
            )
    return "\n".join([*parts, "</svg>"])


def share_svg(share: float) -> str:
    """A bar for a share from 0 to 1."""
    filled = f"{200 * share:.1f}"
    return (
        '<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 200 10" aria-hidden="true">'
        '<rect width="200" height="10" rx="3" fill="var(--raised)" stroke="var(--line)"/>'
        f'<rect width="{filled}" height="10" rx="3" fill="var(--plot-1)"/></svg>'
    )


def _head(width: float, height: float, title: str) -> str:
    return (
        f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {width:.0f} {height:.0f}" role="img" {_FONT}>'
        f"<title>{escaped(title)}</title>"
    )
