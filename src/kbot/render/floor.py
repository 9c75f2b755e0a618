"""The floor of pictures: a fading grid that is darker under the robot.

It follows the page's shader (`web/src/view/ground.ts`), so that pictures and page look alike.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from kbot.render.look import FIELD_OF_VIEW, Look
from kbot.render.palette import AXIS_X, AXIS_Y, Palette
from kbot.render.picture_scene import PictureScene

Array = NDArray[np.float64]


def draw_floor(things: PictureScene, look: Look, palette: Palette) -> tuple[Array, Array, Array]:
    """Return colours (h, w, 3) and opacity (h, w) in 0..1, and the depth along the camera's axis (h, w) in m.

    The depth is inf where there is no floor. The first row is the top of the picture.
    """
    away = look.distance(things.view_radius)
    eye = things.centre + look.towards_eye * away
    half = math.tan(FIELD_OF_VIEW / 2.0)
    across = (np.arange(look.width) + 0.5) / look.width * 2.0 - 1.0
    up = 1.0 - (np.arange(look.height) + 0.5) / look.height * 2.0
    right, above, back = look.axes.T
    rays = (
        across[None, :, None] * half * look.aspect * right + up[:, None, None] * half * above - back
    )  # their component along the axis is 1, so that `depth` below is the distance along it
    with np.errstate(divide="ignore", invalid="ignore"):
        depth = (things.ground - eye[2]) / rays[..., 2]
    seen = (depth > 0.0) & np.isfinite(depth) & (eye[2] > things.ground)
    depth = np.where(seen, depth, np.inf)
    place = eye[:2] + rays[..., :2] * np.where(seen, depth, 0.0)[..., None]
    reach = 4.0 * max(2.0 * away * half * 1.75, things.radius * 2.0)
    off = np.linalg.norm(place - things.centre[:2], axis=-1) / reach
    wide = np.abs(np.gradient(place, axis=0)) + np.abs(np.gradient(place, axis=1))
    cell = 10.0 ** round(math.log10(things.radius * 0.8))  # `Ground.suit` of the page
    colours = np.broadcast_to(palette.floor, (*place.shape[:2], 3))
    colours = _mix(colours, palette.line, _ruled(place / cell, wide / cell))
    colours = _mix(colours, palette.major_line, _ruled(place / (cell * 10.0), wide / (cell * 10.0)))
    on_axis = np.clip(1.1 - np.abs(place) / np.maximum(wide, 1e-12), 0.0, 1.0) * 0.75
    colours = _mix(colours, AXIS_X, on_axis[..., 1])
    colours = _mix(colours, AXIS_Y, on_axis[..., 0])
    near = np.linalg.norm(place - things.centre[:2], axis=-1) / things.radius
    colours = colours * (1.0 - palette.shadow * (1.0 - _smooth(0.15, 1.0, near)))[..., None]
    return colours, np.where(seen, 1.0 - _smooth(0.25, 1.0, off), 0.0), depth


def _ruled(at: Array, wide: Array) -> Array:
    near = np.abs((at - 0.5) % 1.0 - 0.5) / np.maximum(wide, 1e-12)
    faded: Array = np.clip(1.0 - near, 0.0, 1.0) * (1.0 - _smooth(0.25, 0.6, wide))
    widest: Array = faded.max(axis=-1)
    return widest


def _smooth(low: float, high: float, value: Array) -> Array:
    t = np.clip((value - low) / (high - low), 0.0, 1.0)
    smooth: Array = t * t * (3.0 - 2.0 * t)
    return smooth


def _mix(below: Array, above: Array, how_much: Array) -> Array:
    return below * (1.0 - how_much[..., None]) + above * how_much[..., None]
