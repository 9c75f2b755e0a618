"""The floor of pictures: a fading grid that is darker under the robot.

It follows the page's shader (`web/src/view/ground.ts`), so that pictures and page look alike.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from kbot.render.look import FIELD_OF_VIEW, Look
from kbot.render.palette import AXIS_X, AXIS_Y, Colour, Palette
from kbot.render.picture_scene import PictureScene

Array = NDArray[np.float64]


class Floor:
    """The floor of one picture, which is drawn in bands of rows."""

    def __init__(self, things: PictureScene, look: Look, palette: Palette) -> None:
        self._things, self._palette = things, palette
        away = look.distance(things.view_radius)
        half = math.tan(FIELD_OF_VIEW / 2.0)
        eye = things.centre + look.towards_eye * away
        right, above, back = look.axes.T
        up = 1.0 - (np.arange(look.height) + 0.5) / look.height * 2.0
        rays = up * half * above[:, None] - back[:, None]
        # The component of a ray along the camera's axis is 1, so that `depth` is the distance along it. The
        # camera is not tilted sideways, so all rays of a row have the same depth.
        with np.errstate(divide="ignore", invalid="ignore"):
            depth = (things.ground - eye[2]) / rays[2]
        self._seen = (depth > 0.0) & np.isfinite(depth) & (eye[2] > things.ground)
        self.depth = np.where(self._seen, depth, np.inf)
        """The depth (h,) of each row along the camera's axis in m; inf where there is no floor."""
        depth = np.where(self._seen, depth, 0.0)
        # the places of a row are on a line: `middle` (2, h) plus `across` (w,) times `aside` (2, h)
        self._across = (np.arange(look.width) + 0.5) / look.width * 2.0 - 1.0
        self._middle = eye[:2, None] + rays[:2] * depth
        self._aside = (half * look.aspect * right[:2])[:, None] * depth
        self._pixel = 2.0 / look.width
        self._reach = 4.0 * max(2.0 * away * half * 1.75, things.radius * 2.0)
        self._cell = 10.0 ** round(math.log10(things.radius * 0.8))  # `Ground.suit` of the page

    def draw(self, rows: slice) -> tuple[Array, Array]:
        """Return colours (3, rows, w) and opacity (rows, w) in 0..1 of some rows. Row 0 is the top."""
        place = self._on_lines(self._middle, self._aside, rows)
        wide = np.abs(self._aside[:, rows, None]) * self._pixel + np.abs(
            self._on_lines(_slopes(self._middle), _slopes(self._aside), rows)
        )
        colours = self._palette.floor[:, None, None]
        for cell, line in ((self._cell, self._palette.line), (self._cell * 10.0, self._palette.major_line)):
            colours = _mix(colours, line, _ruled(place / cell, wide / cell))
        on_axis = np.clip(1.1 - np.abs(place) / np.maximum(wide, 1e-12), 0.0, 1.0) * 0.75
        colours = _mix(colours, AXIS_X, on_axis[1])
        colours = _mix(colours, AXIS_Y, on_axis[0])
        off = np.hypot(*(place - self._things.centre[:2, None, None]))
        near = _smooth(0.15, 1.0, off / self._things.radius)
        colours = colours * (1.0 - self._palette.shadow * (1.0 - near))
        opacity = 1.0 - _smooth(0.25, 1.0, off / self._reach)
        return colours, np.where(self._seen[rows, None], opacity, 0.0)

    def _on_lines(self, middle: Array, aside: Array, rows: slice) -> Array:
        return middle[:, rows, None] + aside[:, rows, None] * self._across


def _slopes(lines: Array) -> Array:
    """Return the change of each row (2, h) from row to row."""
    return np.gradient(lines, axis=1) if lines.shape[1] > 1 else np.zeros_like(lines)


def _ruled(at: Array, wide: Array) -> Array:
    near = np.abs(at - np.rint(at)) / np.maximum(wide, 1e-12)
    faded: Array = np.clip(1.0 - near, 0.0, 1.0) * (1.0 - _smooth(0.25, 0.6, wide))
    widest: Array = np.maximum(*faded)
    return widest


def _smooth(low: float, high: float, value: Array) -> Array:
    t = np.clip((value - low) / (high - low), 0.0, 1.0)
    smooth: Array = t * t * (3.0 - 2.0 * t)
    return smooth


def _mix(below: Array, above: Colour, how_much: Array) -> Array:
    return below + (above[:, None, None] - below) * how_much
