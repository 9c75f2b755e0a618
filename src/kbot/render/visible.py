"""Hidden surfaces for a vector picture: triangles in an order, and cut, so that painting them one over the
other shows what a depth buffer would.

Each layer (a link) is painted as a whole. Layers are ordered by who stands before whom; what is painted over
something nearer even so is cut up until its hidden pieces can be left out.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Index = NDArray[np.int64]

RESOLUTION = 700
"""Pixels along the longer side of the depth buffer that decides."""
_ROUNDS = 10
_BETWEEN = 500.0  # how much less is asked of what lies between pixels, where depth is known less well
_SMALLEST = 1.5  # pixels along the longest edge: smaller pieces are not cut


@dataclass(frozen=True, slots=True)
class Triangles:
    """`corners` (n, 3, 3): x to the right and y down in pixels, and depth, greater farther away; `layer` (n,)
    and `colour` (n,) are indices of the caller's; `depth` (n,) is what they are painted by in their layer."""

    corners: Array
    layer: Index
    colour: Index
    depth: Array

    def of(self, chosen: NDArray[np.bool_] | Index) -> Triangles:
        return Triangles(self.corners[chosen], self.layer[chosen], self.colour[chosen], self.depth[chosen])


def painted(triangles: Triangles, width: float, height: float) -> Triangles:
    """What is to be painted, in order: layer after layer, and the far before the near within each."""
    scale = RESOLUTION / max(width, height)
    shape = max(1, round(height * scale)), max(1, round(width * scale))
    x, y, z = triangles.corners[..., 0], triangles.corners[..., 1], triangles.corners[..., 2]
    depth_range = float(np.ptp(z)) if len(z) else 1.0
    corners = np.stack([x * scale, y * scale, z], axis=-1)
    work = Triangles(corners, triangles.layer, triangles.colour, triangles.depth)
    near = _depth(work.corners, shape)
    close = 1e-5 * max(depth_range, 1e-12)
    work = work.of(_may_be_seen(work.corners, near, close))
    rank = _layer_order(work, shape)
    for _ in range(_ROUNDS):
        work = work.of(np.lexsort((-work.depth, rank[work.layer])))
        wrong = _painted_over_nearer(work, near, close) & (_longest_edge(work.corners) > _SMALLEST)
        if not wrong.any():
            break
        pieces = _quartered(work.of(wrong))
        work = _joined(work.of(~wrong), pieces.of(_may_be_seen(pieces.corners, near, close)))
    work = work.of(np.lexsort((-work.depth, rank[work.layer])))
    return Triangles(work.corners / (scale, scale, 1.0), work.layer, work.colour, work.depth)


def _depth(corners: Array, shape: tuple[int, int]) -> Array:
    """The nearest depth at each pixel, inf where there is nothing."""
    buffer = np.full(shape, np.inf)
    for triangle in corners:
        rows, columns, inside, depth = _covered(triangle, shape)
        part = buffer[rows, columns]
        np.minimum(part, np.where(inside, depth, np.inf), out=part)
    return buffer


def _covered(triangle: Array, shape: tuple[int, int]) -> tuple[slice, slice, NDArray[np.bool_], Array]:
    """The box of pixels around a triangle; which of their centres it covers, and its depth there."""
    height, width = shape
    (x0, y0, z0), (x1, y1, z1), (x2, y2, z2) = triangle.tolist()
    left, right = max(0, int(min(x0, x1, x2))), min(width, int(max(x0, x1, x2)) + 1)
    top, bottom = max(0, int(min(y0, y1, y2))), min(height, int(max(y0, y1, y2)) + 1)
    rows, columns = slice(top, max(top, bottom)), slice(left, max(left, right))
    area = (x1 - x0) * (y2 - y0) - (x2 - x0) * (y1 - y0)
    px = np.arange(left, columns.stop)[None, :] + 0.5
    py = np.arange(top, rows.stop)[:, None] + 0.5
    if abs(area) < 1e-9:
        nowhere = np.zeros((py.size, px.size), dtype=bool)
        return rows, columns, nowhere, np.zeros(nowhere.shape)
    b = ((px - x0) * (y2 - y0) - (x2 - x0) * (py - y0)) / area
    c = ((x1 - x0) * (py - y0) - (px - x0) * (y1 - y0)) / area
    a = 1.0 - b - c
    return rows, columns, (a >= 0.0) & (b >= 0.0) & (c >= 0.0), a * z0 + b * z1 + c * z2


def _may_be_seen(corners: Array, near: Array, close: float) -> NDArray[np.bool_]:
    """Which triangles are in front somewhere; those between pixels count by their middle."""
    seen = np.zeros(len(corners), dtype=bool)
    for index, triangle in enumerate(corners):
        rows, columns, inside, depth = _covered(triangle, near.shape)
        if inside.any():
            seen[index] = bool((inside & (depth <= near[rows, columns] + close)).any())
        else:
            x, y, z = triangle.mean(axis=0)
            row, column = min(max(int(y), 0), near.shape[0] - 1), min(max(int(x), 0), near.shape[1] - 1)
            seen[index] = z <= near[row, column] + _BETWEEN * close
    return seen


def _layer_order(triangles: Triangles, shape: tuple[int, int]) -> Index:
    """The rank of each layer, painted in rising order: who stands behind another comes first."""
    count = int(triangles.layer.max(initial=-1)) + 1
    depths = [_depth(triangles.corners[triangles.layer == layer], shape) for layer in range(count)]
    before = np.zeros((count, count))  # pixels at which the first stands before the second
    for first in range(count):
        for second in range(first):
            both = np.isfinite(depths[first]) & np.isfinite(depths[second])
            nearer = int((depths[first][both] < depths[second][both]).sum())
            before[first, second], before[second, first] = nearer, int(both.sum()) - nearer
    rank, left = np.zeros(count, dtype=np.int64), list(range(count))
    for place in range(count):
        # the one that stands least before what is still to be painted
        behind = min(left, key=lambda layer: sum(max(0.0, before[layer, o] - before[o, layer]) for o in left))
        rank[behind] = place
        left.remove(behind)
    return rank


def _painted_over_nearer(triangles: Triangles, near: Array, close: float) -> NDArray[np.bool_]:
    """Which triangles end up on top somewhere, painted in order, though something else is nearer there."""
    shape: tuple[int, int] = near.shape
    top = np.full(shape, -1)
    far = np.zeros(shape, dtype=bool)
    for index, triangle in enumerate(triangles.corners):
        rows, columns, inside, depth = _covered(triangle, shape)
        top[rows, columns][inside] = index
        far[rows, columns][inside] = (depth > near[rows, columns] + close)[inside]
    wrong = np.zeros(len(triangles.corners), dtype=bool)
    wrong[np.unique(top[far & (top >= 0)])] = True
    return wrong


def _quartered(triangles: Triangles) -> Triangles:
    a, b, c = (triangles.corners[:, i] for i in range(3))
    ab, bc, ca = (a + b) / 2.0, (b + c) / 2.0, (c + a) / 2.0
    quarters = ((a, ab, ca), (ab, b, bc), (ca, bc, c), (ab, bc, ca))
    corners = np.concatenate([np.stack(quarter, axis=1) for quarter in quarters])
    layer, colour, depth = triangles.layer, triangles.colour, triangles.depth
    return Triangles(corners, np.tile(layer, 4), np.tile(colour, 4), np.tile(depth, 4))


def _longest_edge(corners: Array) -> Array:
    edges = corners[:, :, :2] - np.roll(corners[:, :, :2], 1, axis=1)
    longest: Array = np.linalg.norm(edges, axis=2).max(axis=1, initial=0.0)
    return longest


def _joined(first: Triangles, second: Triangles) -> Triangles:
    return Triangles(
        np.concatenate([first.corners, second.corners]),
        np.concatenate([first.layer, second.layer]),
        np.concatenate([first.colour, second.colour]),
        np.concatenate([first.depth, second.depth]),
    )
