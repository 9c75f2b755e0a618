"""Plot numbers over time as SVG, with axes and a legend."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

from kbot.render.palette import Theme
from kbot.text.xml_text import escaped

MARGIN_LEFT, MARGIN_RIGHT, MARGIN_BOTTOM = 64, 16, 40
LEGEND_LINE = 20
PIXELS_A_TICK = 70

_COLOURS: dict[Theme, tuple[str, ...]] = {
    "dark": ("#5aa9ff", "#f9a046", "#06ffb7", "#ffb1f1", "#ff606a", "#a9a5ab"),
    "light": ("#0a66c8", "#c15600", "#168749", "#9b5395", "#c0002b", "#3f5f59"),
}
"""The colours of the page's plots (`web/src/style/tokens.css`), which are distinct for colour-blind readers
too."""
_PAPER: dict[Theme, tuple[str, str, str]] = {
    "dark": ("#151a21", "#e6eaf0", "#2a333f"),
    "light": ("#ffffff", "#1b222b", "#dde2e9"),
}
"""Background, text and grid lines."""
_LIMITS: dict[Theme, str] = {"dark": "#ff7b72", "light": "#c8281f"}
"""The colour of bounds: the page's colour of errors."""
_VARIABLES = tuple(f"var(--plot-{number})" for number in range(1, 7))
_DASHES = ("", "8 4", "2 3")
"""Dash patterns that keep curves distinct when colours repeat, or in black and white."""


@dataclass(frozen=True, slots=True)
class Curve:
    """One value per time, None where there is no value."""

    label: str
    values: Sequence[float | None]


@dataclass(frozen=True, slots=True)
class Bound:
    """A bound of the values, or with `of_time` of the time. What is above it is not allowed, or below it.

    A bound of values counts since a time in s; None if it is only a reference.
    """

    value: float
    label: str
    is_above: bool = True
    of_time: bool = False
    since: float | None = -math.inf


def plot_svg(
    time: Sequence[float],
    curves: Sequence[Curve],
    width: int,
    height: int,
    theme: Theme | None = "light",
    bounds: Sequence[Bound] = (),
) -> str:
    """Return the curves against `time` in s. A curve breaks where it has no value, and where time jumps
    back.

    What `bounds` do not allow is shaded. Without a theme, the colours are CSS variables of the HTML page
    that contains the plot, named as in `web/src/style/tokens.css`.
    """
    paper, ink, line = ("none", "currentColor", "var(--line)") if theme is None else _PAPER[theme]
    limit = "var(--error)" if theme is None else _LIMITS[theme]
    colours = _VARIABLES if theme is None else _COLOURS[theme]
    columns = max(1, (width - MARGIN_LEFT - MARGIN_RIGHT) // 220)
    top = 12 + LEGEND_LINE * math.ceil(len(curves) / columns)
    known = [value for curve in curves for value in curve.values if value is not None]
    known += [bound.value for bound in bounds if not bound.of_time]
    low_x, high_x = _span([*time, *(bound.value for bound in bounds if bound.of_time)])
    low_y, high_y = _span(known, 0.05)
    inner_width, inner_height = width - MARGIN_LEFT - MARGIN_RIGHT, height - top - MARGIN_BOTTOM

    def x(value: float) -> float:
        return MARGIN_LEFT + (value - low_x) / (high_x - low_x) * inner_width

    def y(value: float) -> float:
        return top + (high_y - value) / (high_y - low_y) * inner_height

    title = ", ".join(curve.label for curve in curves) or "nothing"
    parts = [
        f'<svg xmlns="http://www.w3.org/2000/svg" width="{width}" height="{height}"'
        f' viewBox="0 0 {width} {height}" role="img" font-family="sans-serif" font-size="12" fill="{ink}">',
        f"<title>{escaped(title)} against time</title>",
        f'<rect width="100%" height="100%" fill="{paper}"/>',
    ]
    for tick in round_ticks(low_x, high_x, inner_width / PIXELS_A_TICK):
        at = f"{x(tick):.1f}"
        parts.append(f'<path stroke="{line}" d="M{at} {top}V{top + inner_height}"/>')
        parts.append(f'<text x="{at}" y="{height - 22}" text-anchor="middle">{tick:g}</text>')
    for tick in round_ticks(low_y, high_y, inner_height / (PIXELS_A_TICK / 2)):
        at = f"{y(tick):.1f}"
        parts.append(f'<path stroke="{line}" d="M{MARGIN_LEFT} {at}H{width - MARGIN_RIGHT}"/>')
        parts.append(f'<text x="{MARGIN_LEFT - 8}" y="{at}" dy="0.35em" text-anchor="end">{tick:g}</text>')
    box = MARGIN_LEFT, top, width - MARGIN_RIGHT, top + inner_height
    for bound in bounds:
        place = x(bound.value) if bound.of_time else y(bound.value)
        since = MARGIN_LEFT if bound.since == -math.inf else None if bound.since is None else x(bound.since)
        parts += _drawn_bound(bound, place, box, since, limit)
    middle = MARGIN_LEFT + inner_width / 2
    parts.append(f'<text x="{middle:.0f}" y="{height - 6}" text-anchor="middle">time [s]</text>')
    for number, curve in enumerate(curves):
        dash = _DASHES[number // len(colours) % len(_DASHES)]
        style = f'stroke="{colours[number % len(colours)]}"' + (f' stroke-dasharray="{dash}"' if dash else "")
        row, column = divmod(number, columns)
        legend_x, legend_y = MARGIN_LEFT + column * 220, 14 + row * LEGEND_LINE
        parts.append(f'<path {style} stroke-width="2" d="M{legend_x} {legend_y}h18"/>')
        parts.append(f'<text x="{legend_x + 24}" y="{legend_y}" dy="0.35em">{escaped(curve.label)}</text>')
        path = _path(
            [(t, x(t), None if v is None else y(v)) for t, v in zip(time, curve.values, strict=True)]
        )
        # names must be unique in a page, which may contain several plots
        name = "" if theme is None else f'id="{escaped(curve.label)}" '
        parts.append(
            f'<path {name}{style} fill="none" stroke-width="1.5" stroke-linejoin="round" d="{path}"/>'
        )
    return "\n".join([*parts, "</svg>"]) + "\n"


def _drawn_bound(
    bound: Bound, at: float, box: tuple[float, float, float, float], since: float | None, colour: str
) -> list[str]:
    """The line of a bound at `at` pixels, its label, and the shade over what it does not allow.

    `box` is left, top, right and bottom of the plane in pixels. The shade begins at `since`, also in pixels.
    """
    left, top, right, bottom = box
    if bound.of_time:
        line = f"M{at:.1f} {top}V{bottom}"
        shade = (at, top, right, bottom) if bound.is_above else (left, top, at, bottom)
        is_right = at > (left + right) / 2  # the label is where there is more room
        anchor, label_x, label_y = ("end", at - 5, top + 14) if is_right else ("start", at + 5, top + 14)
    else:
        line = f"M{left} {at:.1f}H{right}"
        begin = right if since is None else since
        shade = (begin, top, right, at) if bound.is_above else (begin, at, right, bottom)
        # the label is where values are allowed, unless there is no room
        is_below = at + 20 < bottom if bound.is_above else at - 20 < top
        anchor, label_x, label_y = "end", right - 5, at + (15 if is_below else -6)
    first_x, first_y, last_x, last_y = shade
    return [
        f'<rect x="{first_x:.1f}" y="{first_y:.1f}" width="{last_x - first_x:.1f}"'
        f' height="{last_y - first_y:.1f}" fill="{colour}" fill-opacity="0.09"/>',
        f'<path stroke="{colour}" stroke-width="1.5" stroke-dasharray="6 4" d="{line}"/>',
        f'<text x="{label_x:.1f}" y="{label_y:.1f}" text-anchor="{anchor}" fill="{colour}">'
        f"{escaped(bound.label)}</text>",
    ]


def _path(points: Sequence[tuple[float, float, float | None]]) -> str:
    """Return an SVG path through points of time, x and y."""
    words: list[str] = []
    before, is_down = -math.inf, False
    for time, x, y in points:
        if y is None:
            is_down = False
            continue
        words.append(f"{'L' if is_down and time >= before else 'M'}{x:.2f} {y:.2f}")
        before, is_down = time, True
    return "".join(words)


def _span(values: Sequence[float], margin: float = 0.0) -> tuple[float, float]:
    """Return the lowest and the highest value, widened by `margin` of their distance; never two equal
    numbers."""
    low, high = (min(values), max(values)) if values else (0.0, 1.0)
    if high - low <= 1e-12 * max(abs(low), abs(high), 1e-300):
        reach = abs(low) * 0.1 or 0.5
        return low - reach, high + reach
    around = (high - low) * margin
    return low - around, high + around


def round_ticks(low: float, high: float, most: float) -> list[float]:
    """Return multiples of 1, 2 or 5 times a power of ten within a range, at most `most` of them."""
    rough = (high - low) / max(most, 1.0)
    power = 10.0 ** math.floor(math.log10(rough))
    step = next(factor * power for factor in (1.0, 2.0, 5.0, 10.0) if factor * power >= rough * (1 - 1e-9))
    first, last = math.ceil(low / step - 1e-9), math.floor(high / step + 1e-9)
    return [round(number * step, 12) for number in range(first, last + 1)]
