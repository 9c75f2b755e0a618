"""Draw a run from above as SVG, in the colours of the HTML page that contains it.

The colours are CSS variables, named as in `web/src/style/tokens.css`, so that the picture follows the page
from light to dark, and to print.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from kbot.render.plot import round_ticks
from kbot.text.xml_text import escaped

WIDTH, LOWEST, HIGHEST = 560, 220, 560
"""Size of the plane in pixels: its width, and its height at least and at most."""
_LEFT, _RIGHT, _TOP, _BOTTOM = 46, 12, 12, 34
_PIXELS_A_LINE = 60
"""At least this many pixels are between two lines of the grid."""
_LEAST = 0.5
"""The smallest width of the shown area in m."""
_NEAR = 0.5
"""Points of a path that are nearer to the last drawn one than this many pixels are not drawn."""

Point = tuple[float, float]
Array = NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class Area:
    """A polygon in the world in m. `look` is `wall`, `ground`, `touched`, `start` or `end`."""

    corners: Sequence[Point]
    look: str
    name: str = ""


@dataclass(frozen=True, slots=True)
class Circle:
    """A place in the world in m for the robot to reach or pass; a point if the radius is 0."""

    x: float
    y: float
    radius: float
    name: str


@dataclass(frozen=True, slots=True)
class Mark:
    """A numbered place on the path."""

    x: float
    y: float
    number: int


@dataclass(frozen=True, slots=True)
class PathPicture:
    """A run from above: paths (n, 2) in m, and what is around them."""

    title: str
    truth: Array
    odometry: Array
    areas: Sequence[Area] = ()
    circles: Sequence[Circle] = ()
    marks: Sequence[Mark] = field(default=())


_AREAS = {
    "wall": 'fill="var(--wall)"',
    "ground": 'fill="var(--ramp)"',
    "touched": 'fill="var(--error)" fill-opacity="0.75"',
    "start": 'fill="var(--good)" fill-opacity="0.2" stroke="var(--good)" stroke-width="1.5"',
    "end": 'fill="var(--plot-1)" fill-opacity="0.2" stroke="var(--plot-1)" stroke-width="1.5"',
}


def path_svg(picture: PathPicture) -> str:
    """Return the run from above: x to the right and y up, with a grid in m."""
    (low_x, low_y), (high_x, high_y) = _extent(picture)
    scale = min(WIDTH / (high_x - low_x), HIGHEST / (high_y - low_y))
    height = max(LOWEST, round(scale * (high_y - low_y)))
    middle = (low_x + high_x) / 2, (low_y + high_y) / 2
    low_x, high_x = middle[0] - WIDTH / scale / 2, middle[0] + WIDTH / scale / 2
    low_y, high_y = middle[1] - height / scale / 2, middle[1] + height / scale / 2

    def x(value: float) -> float:
        return (value - low_x) * scale

    def y(value: float) -> float:
        return (high_y - value) * scale

    def pixels(points: Iterable[Point]) -> str:
        return " ".join(f"{x(a):.1f},{y(b):.1f}" for a, b in points)

    whole = f"{-_LEFT} {-_TOP} {_LEFT + WIDTH + _RIGHT} {_TOP + height + _BOTTOM}"
    parts = [
        f'<svg xmlns="http://www.w3.org/2000/svg" width="{_LEFT + WIDTH + _RIGHT}"'
        f' height="{_TOP + height + _BOTTOM}" viewBox="{whole}" role="img" font-family="sans-serif"'
        ' font-size="12" fill="currentColor">',
        f"<title>{escaped(picture.title)}</title>",
        f'<rect width="{WIDTH}" height="{height}" fill="var(--picture)"/>',
        # nested, so that it cuts off what is outside of the plane
        f'<svg width="{WIDTH}" height="{height}" viewBox="0 0 {WIDTH} {height}">',
    ]
    columns = round_ticks(low_x, high_x, WIDTH / _PIXELS_A_LINE)
    rows = round_ticks(low_y, high_y, height / _PIXELS_A_LINE)
    for at in columns:
        parts.append(f'<path stroke="{_line(at)}" d="M{x(at):.1f} 0V{height}"/>')
    for at in rows:
        parts.append(f'<path stroke="{_line(at)}" d="M0 {y(at):.1f}H{WIDTH}"/>')
    for area in picture.areas:
        name = f"<title>{escaped(area.name)}</title>" if area.name else ""
        parts.append(f'<polygon {_AREAS[area.look]} points="{pixels(area.corners)}">{name}</polygon>')
    for circle in picture.circles:
        parts.append(
            f'<circle cx="{x(circle.x):.1f}" cy="{y(circle.y):.1f}" r="{max(4.0, circle.radius * scale):.1f}"'
            ' fill="var(--selected)" fill-opacity="0.18" stroke="var(--selected)" stroke-width="1.5">'
            f"<title>{escaped(circle.name)}</title></circle>"
            f'<path stroke="var(--selected)" stroke-width="1.5" d="M{x(circle.x) - 4:.1f} {y(circle.y):.1f}h8'
            f'm-4 -4v8"/>'
        )
    for path, style in (
        (picture.odometry, 'stroke="var(--plot-2)" stroke-width="3" stroke-dasharray="7 4"'),
        (picture.truth, 'stroke="var(--plot-1)" stroke-width="2.5"'),
    ):
        points = pixels(_thinned(path, _NEAR / scale))
        parts.append(f'<polyline {style} fill="none" stroke-linejoin="round" points="{points}"/>')
    for mark in reversed(picture.marks):
        parts.append(
            f'<circle cx="{x(mark.x):.1f}" cy="{y(mark.y):.1f}" r="8.5" fill="var(--panel)"'
            ' stroke="currentColor"/>'
            f'<text x="{x(mark.x):.1f}" y="{y(mark.y):.1f}" dy="0.36em" font-size="10.5"'
            f' text-anchor="middle">{mark.number}</text>'
        )
    parts.append("</svg>")
    for at in columns:
        parts.append(f'<text x="{x(at):.1f}" y="{height + 16}" text-anchor="middle">{at:g}</text>')
    for at in rows:
        parts.append(f'<text x="-7" y="{y(at):.1f}" dy="0.35em" text-anchor="end">{at:g}</text>')
    parts.append(f'<text x="{WIDTH / 2:.0f}" y="{height + 30}" text-anchor="middle">x [m]</text>')
    parts.append(
        f'<text x="{-_LEFT + 12}" y="{height / 2:.0f}" text-anchor="middle"'
        f' transform="rotate(-90 {-_LEFT + 12} {height / 2:.0f})">y [m]</text>'
    )
    return "\n".join([*parts, "</svg>"])


def _line(at: float) -> str:
    return "var(--strong-line)" if at == 0.0 else "var(--line)"


def _extent(picture: PathPicture) -> tuple[Point, Point]:
    """Lowest and highest corner of what must be visible, with a margin."""
    points = [
        *picture.truth.tolist(),
        *picture.odometry.tolist(),
        *(
            p
            for area in picture.areas
            if area.look in ("start", "end", "touched")
            for p in _near(picture, area)
        ),
        *((c.x + side * c.radius, c.y + side * c.radius) for c in picture.circles for side in (-1.0, 1.0)),
    ]
    low, high = np.min(points, axis=0), np.max(points, axis=0)
    margin = max(0.1 * float((high - low).max()), (_LEAST - float((high - low).max())) / 2, 0.05)
    return (float(low[0] - margin), float(low[1] - margin)), (
        float(high[0] + margin),
        float(high[1] + margin),
    )


def _near(picture: PathPicture, area: Area) -> Iterator[Point]:
    """The corners of an area; of a touched one only those near the path, because a wall may be long."""
    if area.look != "touched":
        yield from area.corners
        return
    reach = max(_LEAST, float(np.ptp(picture.truth, axis=0).max()) / 4)
    low, high = picture.truth.min(axis=0) - reach, picture.truth.max(axis=0) + reach
    for corner in area.corners:
        x, y = np.clip(corner, low, high)
        yield float(x), float(y)


def _thinned(path: Array, apart: float) -> Iterator[Point]:
    """The points of a path that are `apart` m from the previous one, and the last one."""
    last = (math.inf, math.inf)
    for index, (x, y) in enumerate(path.tolist()):
        if math.hypot(x - last[0], y - last[1]) >= apart or index == len(path) - 1:
            last = (x, y)
            yield last
