"""Draws points, lines and text of the user's program in the scene, as markers on the topic `/draw`."""

from __future__ import annotations

import re
import reprlib

import numpy as np
from numpy.typing import ArrayLike, NDArray

from kbot.brief import Brief
from kbot.messages.bus import Bus, Publisher
from kbot.messages.clock import Clock
from kbot.messages.program_topics import DRAWN
from kbot.messages.types import WORLD, Header, Point, Pose, Vector3
from kbot.messages.visualization import (
    DELETE_ALL,
    LINE_STRIP,
    SPHERE_LIST,
    TEXT_VIEW_FACING,
    ColorRGBA,
    Marker,
    MarkerArray,
)
from kbot.sim.numbers import FURTHEST, is_finite, positive
from kbot.text import KbotError
from kbot.text.suggest import did_you_mean

ON_FLOOR = 0.01
"""Height in m of positions without z, so that the floor does not hide them."""
MOST_DRAWINGS = 200
"""The page draws each one by itself, and every message contains all of them."""
MOST_POINTS = 5000
"""Points of one drawing. The page receives all of them in each message."""
LONGEST_TEXT = 500
"""Characters. The page draws them on a canvas with up to 64 px for each, and Firefox limits a canvas to
32,767 px."""
LARGEST = 100.0
"""Size of points and text, and width of lines, in m: as large as the largest box that can be added."""
ORANGE = "#f76b15"
"""The default colour: visible on a light and on a dark floor."""

COLORS = {
    "black": "#000000",
    "blue": "#0090ff",
    "brown": "#ad7f58",
    "cyan": "#00a2c7",
    "gray": "#8d8d8d",
    "green": "#30a46c",
    "grey": "#8d8d8d",
    "magenta": "#d6409f",
    "orange": ORANGE,
    "purple": "#8e4ec6",
    "red": "#e5484d",
    "white": "#ffffff",
    "yellow": "#ffc53d",
}
_HEX = re.compile(r"#[0-9A-Fa-f]{6}")
Color = str | tuple[float, float, float] | tuple[float, float, float, float]
"""A name in `COLORS`, `#rrggbb`, or red, green, blue and perhaps opacity from 0 to 1."""


class Drawings(Brief):
    """Drawings by name, in metres in the world's frame. Drawing again under a name replaces its drawing.

    Changes are published together at the end of the next step, or by `publish`.
    """

    def __init__(self, bus: Bus, clock: Clock) -> None:
        self._bus, self._clock = bus, clock
        self._markers: dict[str, Marker] = {}
        self._publisher: Publisher[MarkerArray] | None = None
        self._is_waiting = False

    def points(self, name: str, positions: ArrayLike, color: Color = ORANGE, size: float = 0.03) -> None:
        """Draw balls of diameter `size` (m) at `positions`, of shape (n, 3) or (n, 2).

        Positions with two numbers are 1 cm above the floor.

        Raises:
            KbotError: an argument is not valid. The message names it and the reason.
        """
        side = positive(f"draw {reprlib.repr(name)}: the size", size, LARGEST)
        self._draw(name, SPHERE_LIST, Vector3(side, side, side), color, _points(name, positions))

    def line(self, name: str, positions: ArrayLike, color: Color = ORANGE, width: float = 0.01) -> None:
        """Draw a line of `width` (m) through `positions`, as in `points`.

        Raises:
            KbotError: an argument is not valid. The message names it and the reason.
        """
        wide = positive(f"draw {reprlib.repr(name)}: the width", width, LARGEST)
        self._draw(name, LINE_STRIP, Vector3(wide, 0.0, 0.0), color, _points(name, positions))

    def text(
        self, name: str, position: ArrayLike, text: object, color: Color = ORANGE, size: float = 0.08
    ) -> None:
        """Draw text of height `size` (m) at a position x, y, z or x, y. It always faces the camera.

        Raises:
            KbotError: an argument is not valid. The message names it and the reason.
        """
        place = _points(name, position)
        if len(place) != 1:
            raise KbotError(f"draw {reprlib.repr(name)}: a text needs one position, not {len(place)}")
        shown = str(text)
        if len(shown) > LONGEST_TEXT:
            raise KbotError(f"draw {reprlib.repr(name)}: a text has at most {LONGEST_TEXT} characters")
        high = positive(f"draw {reprlib.repr(name)}: the size", size, LARGEST)
        self._draw(name, TEXT_VIEW_FACING, Vector3(0.0, 0.0, high), color, place, shown)

    def clear(self, name: str | None = None) -> None:
        """Remove the drawing of a name, or all. A name without a drawing is ignored."""
        before = len(self._markers)
        if name is None:
            self._markers.clear()
        else:
            self._markers.pop(name, None)
        if len(self._markers) < before:
            self._publish_later()

    def _draw(
        self, name: str, kind: int, scale: Vector3, color: Color, points: tuple[Point, ...], text: str = ""
    ) -> None:
        if not (isinstance(name, str) and 0 < len(name) <= 100):
            raise KbotError(f"a drawing needs a name of 1 to 100 characters, not {reprlib.repr(name)}")
        if name not in self._markers and len(self._markers) >= MOST_DRAWINGS:
            raise KbotError(f"draw {name!r}: the limit is {MOST_DRAWINGS} drawings. Clear some first")
        pose = Pose(position=points[0]) if kind == TEXT_VIEW_FACING else Pose()
        self._markers[name] = Marker(
            header=Header(self._clock.stamp, WORLD),
            ns=name,
            type=kind,
            pose=pose,
            scale=scale,
            color=_color(name, color),
            points=() if kind == TEXT_VIEW_FACING else points,
            text=text,
        )
        self._publish_later()

    def _publish_later(self) -> None:
        if not self._is_waiting:
            self._is_waiting = True
            self._clock.after_timers(self.publish)

    def publish(self) -> None:
        """Publish the changes now."""
        if not self._is_waiting:
            return
        self._is_waiting = False
        if self._publisher is None:
            self._publisher = self._bus.advertise(DRAWN, MarkerArray, latched=True)
            self._bus.announce()
        # the whole set in each message: the last one is all that a late subscriber gets
        self._publisher.publish(MarkerArray((Marker(action=DELETE_ALL), *self._markers.values())))


def _points(name: str, positions: ArrayLike) -> tuple[Point, ...]:
    what = f"draw {reprlib.repr(name)}: positions"
    try:
        given: NDArray[np.float64] = np.atleast_2d(np.asarray(positions, np.float64))
    except (TypeError, ValueError):
        raise KbotError(f"{what} must be x, y, z or a list of them, not {reprlib.repr(positions)}") from None
    if given.size == 0:
        return ()
    if given.ndim != 2 or given.shape[1] not in (2, 3):
        raise KbotError(f"{what} must have the shape (n, 3) or (n, 2), not {given.shape}")
    if len(given) > MOST_POINTS:
        raise KbotError(f"{what}: {len(given)} points, the limit is {MOST_POINTS}")
    if not (np.abs(given) <= FURTHEST).all():  # false for NaN too
        raise KbotError(f"{what} must be finite and at most {FURTHEST:g} m")
    if given.shape[1] == 2:
        given = np.column_stack((given, np.full(len(given), ON_FLOOR)))
    return tuple(Point(x, y, z) for x, y, z in given.tolist())


def _color(name: str, color: Color) -> ColorRGBA:
    if isinstance(color, str):
        code = COLORS.get(color.lower(), color)
        if _HEX.fullmatch(code):
            red, green, blue = (int(code[at : at + 2], 16) / 255.0 for at in (1, 3, 5))
            return ColorRGBA(red, green, blue, 1.0)
        hint = did_you_mean(color, COLORS) or f"choose from {', '.join(COLORS)}, or write #rrggbb"
        raise KbotError(f"draw {name!r}: unknown color {reprlib.repr(color)}: {hint}")
    parts = tuple(color) if isinstance(color, tuple | list | np.ndarray) else ()
    if len(parts) not in (3, 4) or not all(is_finite(part) and 0.0 <= part <= 1.0 for part in parts):
        raise KbotError(
            f"draw {name!r}: the color must be a name, #rrggbb, or three or four numbers from 0 to 1, not "
            f"{reprlib.repr(color)}"
        )
    return ColorRGBA(*(float(part) for part in (*parts, 1.0)[:4]))
