"""Polygons as solids: cut into triangles, each of them raised to a prism."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from kbot.text import KbotError
from kbot.world.world import Mesh

Point = tuple[float, float]
Outline = list[Point]

PRISM = np.array(
    [[0, 2, 1], [3, 4, 5], [0, 1, 4], [0, 4, 3], [1, 2, 5], [1, 5, 4], [2, 0, 3], [2, 3, 5]], dtype=np.int32
)
"""Faces of a prism: corners 0 to 2 below, 3 to 5 above them."""


def prisms(outline: Sequence[Point], height: float) -> list[Mesh]:
    """Prisms that fill a simple polygon from z = 0 to `height` (m).

    Raises:
        KbotError: fewer than three corners, no area, or sides that cross.
    """
    meshes = []
    for triangle in triangles(outline):
        flat = np.array(triangle)
        low = np.column_stack([flat, np.zeros(3)])
        high = np.column_stack([flat, np.full(3, height)])
        meshes.append(Mesh(np.vstack([low, high]), PRISM))
    return meshes


def triangles(outline: Sequence[Point]) -> list[tuple[Point, Point, Point]]:
    """Cut a simple polygon into triangles by taking off ears (Meisters 1975). Raises as `prisms`."""
    corners = [p for i, p in enumerate(outline) if p != outline[i - 1]]
    if len(corners) < 3:
        raise KbotError("an outline needs at least three corners")
    area = sum(_cross((0.0, 0.0), a, b) for a, b in zip(corners, corners[1:] + corners[:1], strict=True))
    if area == 0.0:
        raise KbotError("an outline encloses no area")
    if area < 0.0:
        corners.reverse()
    found = []
    while len(corners) > 3:
        ear = next((i for i in range(len(corners)) if _is_ear(corners, i)), None)
        if ear is None:
            raise KbotError("the sides of an outline cross each other")
        a, b, c = corners[ear - 1], corners[ear], corners[(ear + 1) % len(corners)]
        if _cross(a, b, c) > 0.0:
            found.append((a, b, c))
        del corners[ear]
    found.append((corners[0], corners[1], corners[2]))
    return [t for t in found if _cross(*t) > 0.0]


def _cross(o: Point, a: Point, b: Point) -> float:
    return (a[0] - o[0]) * (b[1] - o[1]) - (a[1] - o[1]) * (b[0] - o[0])


def _is_ear(corners: Sequence[Point], index: int) -> bool:
    a, b, c = corners[index - 1], corners[index], corners[(index + 1) % len(corners)]
    if _cross(a, b, c) < 0.0:
        return False
    others = (p for p in corners if p not in (a, b, c))
    return not any(_cross(a, b, p) >= 0 and _cross(b, c, p) >= 0 and _cross(c, a, p) >= 0 for p in others)
