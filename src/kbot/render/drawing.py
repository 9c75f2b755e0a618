"""The robot as an SVG drawing: seen from infinitely far (orthographic), one group for each link."""

from __future__ import annotations

from itertools import groupby
from xml.sax.saxutils import escape, quoteattr

import numpy as np
from numpy.typing import NDArray

from kbot.model.meshes import MeshPart
from kbot.render.look import Look
from kbot.render.normals import face_normals
from kbot.render.palette import PALETTES, Theme
from kbot.render.surfaces import Surface
from kbot.render.things import Things
from kbot.render.visible import Triangles, painted
from kbot.workbench.meshes.simplify import simplify

Array = NDArray[np.float64]

_MARGIN = 1.04
_MOST_TRIANGLES = 4_000  # of a part; a drawing of more is no longer one
_SUN = np.array([1.6, -2.2, 4.5]) / np.linalg.norm([1.6, -2.2, 4.5])


def svg(things: Things, look: Look, name: str, theme: Theme = "dark") -> str:
    """The links of a robot, whose `name` becomes the title; nothing else of the world.

    Each link is `<g id="LINK">` with its name as the `<title>` that a browser shows when it is pointed at.
    """
    names = list(things.links)
    corners, layers, colours = [], [], []
    table: list[str] = []
    for layer, link in enumerate(names):
        for surface in map(_lighter, things.links[link]):
            shades, which = np.unique(_shaded(surface), axis=0, return_inverse=True)
            colours.append(which.reshape(-1) + len(table))
            table += [_hex(shade) for shade in shades]
            corners.append(_projected(things, look, surface.vertices[surface.faces]))
            layers.append(np.full(len(surface.faces), layer))
    if corners:
        placed = np.concatenate(corners)
        depth = placed[..., 2].mean(axis=1)
        all_of_them = Triangles(placed, np.concatenate(layers), np.concatenate(colours), depth)
        shown = painted(all_of_them, look.width, look.height)
    else:
        none = np.zeros(0, dtype=np.int64)
        shown = Triangles(np.zeros((0, 3, 3)), none, none, np.zeros(0))
    lines = [
        f'<svg xmlns="http://www.w3.org/2000/svg" width="{look.width}" height="{look.height}"'
        f' viewBox="0 0 {look.width} {look.height}" role="img" stroke-width="0.7" stroke-linejoin="round">',
        f"<title>{escape(name)}</title>",
    ]
    if not look.transparent:
        lines.append(f'<rect width="100%" height="100%" fill="{_hex(PALETTES[theme].background)}"/>')
    drawn = {
        names[layer]: list(run) for layer, run in groupby(range(len(shown.layer)), shown.layer.__getitem__)
    }
    for link in (*drawn, *(link for link in names if link not in drawn)):
        lines.append(f"<g id={quoteattr(link)}><title>{escape(link)}</title>")
        for colour, run in groupby(drawn.get(link, ()), shown.colour.__getitem__):
            path = "".join(_path(shown.corners[index]) for index in run)
            opacity = "" if len(table[colour]) == 7 else f' opacity="{int(table[colour][7:], 16) / 255:.3g}"'
            fill = table[colour][:7]
            lines.append(f'<path fill="{fill}" stroke="{fill}"{opacity} d="{path}"/>')
        lines.append("</g>")
    lines.append("</svg>")
    return "\n".join(lines) + "\n"


def _projected(things: Things, look: Look, points: Array) -> Array:
    """x to the right and y down in pixels, and how far behind the middle in m; of points (…, 3) in m."""
    right, up, back = ((points - things.centre) @ axis for axis in look.axes.T)
    scale = min(look.width, look.height) / (2.0 * things.view_radius * _MARGIN)
    return np.stack([look.width / 2.0 + right * scale, look.height / 2.0 - up * scale, -back], axis=-1)


def _lighter(surface: Surface) -> Surface:
    if len(surface.faces) <= _MOST_TRIANGLES:
        return surface
    part = MeshPart(surface.vertices, surface.faces, surface.rgba)
    (fewer,) = simplify((part,), _MOST_TRIANGLES)
    return Surface(fewer.vertices, fewer.faces, surface.rgba)


def _shaded(surface: Surface) -> Array:
    """rgba (m, 4) of each face in 0..1: lit by the sky and the sun, whichever way it is wound."""
    normals = face_normals(surface.vertices, surface.faces)
    normals = normals / np.maximum(np.linalg.norm(normals, axis=1), 1e-300)[:, None]
    light = 0.55 + 0.13 * normals[:, 2] + 0.37 * np.clip(normals @ _SUN, 0.0, 1.0)
    colours = np.empty((len(light), 4))
    colours[:, :3] = np.asarray(surface.rgba[:3]) * np.round(light, 2)[:, None]
    colours[:, 3] = surface.rgba[3]
    return np.clip(colours, 0.0, 1.0)


def _hex(colour: Array) -> str:
    """#rrggbb, with aa where something shows through."""
    bytes_ = [round(float(part) * 255) for part in colour]
    return "#" + "".join(f"{part:02x}" for part in bytes_[: 3 if bytes_[3:] in ([], [255]) else 4])


def _path(corners: Array) -> str:
    """All are wound the same way, so that none cancels another in one path."""
    (x0, y0, _), (x1, y1, _), (x2, y2, _) = corners.tolist()
    if (x1 - x0) * (y2 - y0) < (x2 - x0) * (y1 - y0):
        x1, y1, x2, y2 = x2, y2, x1, y1
    return f"M{x0:.2f} {y0:.2f}L{x1:.2f} {y1:.2f} {x2:.2f} {y2:.2f}z"
