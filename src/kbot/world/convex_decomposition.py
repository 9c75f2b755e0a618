"""Splits hollow meshes into convex pieces, because the engine collides with convex hulls."""

from __future__ import annotations

from collections.abc import Iterator
from functools import lru_cache
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from kbot.kinematics.planar import convex_hull, twice_area
from kbot.world.world import TriangleMesh

THICKNESS = 0.005
"""Thickness in m of the plate that replaces a patch of a hollow surface. It is behind the patch."""

MOST_PIECES = 4000
"""A mesh of more pieces collides as its convex hull."""
_FLAT = 1e-4
"""Distance, as a share of the mesh's size, up to which a vertex counts as on a face."""
_NARROW = 2e-4
"""Height of a triangle, as a share of its longest edge, up to which it gets no plate."""
_PARALLEL = 1.0 - 1e-8
"""Cosine of the angle between two triangles from which they are in one plane."""
_MOST_TRIANGLES = 24
"""Most triangles of a plate. Its hull in the engine has at most 64 vertices."""


@lru_cache(maxsize=64)
def convex_pieces(mesh: TriangleMesh) -> tuple[TriangleMesh, ...] | None:
    """Split a mesh into convex pieces.

    A convex mesh is returned as it is. Otherwise each connected part is a piece if it is convex. A part that
    is not becomes thin plates, one per flat and convex patch of its surface. None if there would be more than
    `MOST_PIECES`.
    """
    vertices, indices = np.unique(np.round(mesh.vertices, 7), axis=0, return_inverse=True)
    faces = indices.reshape(-1)[mesh.faces]
    if _is_convex(vertices, faces):
        return (mesh,)
    pieces: list[TriangleMesh] = []
    for part in _connected(len(vertices), faces):
        used, renumbered = np.unique(part, return_inverse=True)
        own, own_faces = vertices[used], renumbered.reshape(part.shape)
        if _is_convex(own, own_faces):
            pieces.append(TriangleMesh(own, own_faces.astype(np.int32)))
        elif len(pieces) + len(own_faces) > MOST_PIECES:
            return None  # before the plates of many triangles are made, which takes seconds
        else:
            pieces += _plates(own, own_faces)
        if len(pieces) > MOST_PIECES:
            return None
    return tuple(pieces)


def _is_convex(vertices: NDArray[np.float64], faces: NDArray[np.intp]) -> bool:
    """Whether no vertex is in front of a face. A flat piece does not count as convex: it has no volume."""
    size = float(np.ptp(vertices, axis=0).max())
    corner = vertices[faces[:, 0]]
    normal = np.cross(vertices[faces[:, 1]] - corner, vertices[faces[:, 2]] - corner)
    length = np.linalg.norm(normal, axis=1)
    solid = length > 0.0
    normal, corner = normal[solid] / length[solid, None], corner[solid]
    deepest = 0.0
    for start in range(0, len(normal), 256):
        rows = slice(start, start + 256)
        reach = normal[rows] @ vertices.T - np.sum(normal[rows] * corner[rows], axis=1)[:, None]
        if reach.max(initial=0.0) > _FLAT * size:
            return False
        deepest = min(deepest, float(reach.min(initial=0.0)))
    return deepest < -_FLAT * size


def _connected(count: int, faces: NDArray[np.intp]) -> list[NDArray[np.intp]]:
    """The faces of each connected part. Faces are connected if they share vertices."""
    label = np.arange(count)
    while True:
        lowest = label[faces].min(axis=1)
        new = label.copy()
        for column in range(3):
            np.minimum.at(new, faces[:, column], lowest)
        new = new[new]
        if (new == label).all():
            break
        label = new
    of_face = label[faces[:, 0]]
    return [faces[of_face == value] for value in np.unique(of_face)]


def _plates(vertices: NDArray[np.float64], faces: NDArray[np.intp]) -> list[TriangleMesh]:
    """A thin plate behind every convex group of triangles in a plane."""
    edges = vertices[faces[:, [1, 2, 0]]] - vertices[faces]
    normals = np.cross(edges[:, 0], edges[:, 1])
    areas = np.linalg.norm(normals, axis=1)
    # the engine's hull of a sliver is imprecise, and the gap that it leaves is narrower than a millimetre
    kept = areas > np.maximum(_NARROW * (edges**2).sum(axis=2).max(axis=1), 1e-9)
    faces, normals = faces[kept], normals[kept] / areas[kept, None]
    return [_plate(vertices, faces[patch], normals[patch[0]]) for patch in _patches(vertices, faces, normals)]


def _patches(
    vertices: NDArray[np.float64], faces: NDArray[np.intp], normals: NDArray[np.float64]
) -> Iterator[list[int]]:
    """Split the triangles into patches that are flat and convex. Each grows by one neighbour at a time."""
    at_edge: dict[tuple[int, int], list[int]] = {}
    for index, (a, b, c) in enumerate(faces.tolist()):
        for edge in ((a, b), (b, c), (c, a)):
            at_edge.setdefault(edge, []).append(index)
    free = dict.fromkeys(range(len(faces)))
    while free:
        seed = next(iter(free))
        del free[seed]
        patch, tried = [seed], set[int]()
        waiting = [seed]
        while waiting:
            a, b, c = faces[waiting.pop()].tolist()
            # a neighbour of the same side has the edge in the other direction
            for other in (i for edge in ((b, a), (c, b), (a, c)) for i in at_edge.get(edge, ())):
                if other not in free or other in tried or normals[other] @ normals[seed] < _PARALLEL:
                    continue
                tried.add(other)
                more = vertices[faces[[*patch, other]]]
                if len(patch) < _MOST_TRIANGLES and _is_convex_patch(more, normals[seed]):
                    del free[other]
                    patch.append(other)
                    waiting.append(other)
                    tried.clear()  # it may make a neighbour convex that was not
        yield patch


def _is_convex_patch(triangles: NDArray[np.float64], normal: NDArray[np.float64]) -> bool:
    """Whether triangles (n, 3, 3) in a plane fill their convex outline."""
    axis = np.eye(3)[int(np.argmin(np.abs(normal)))]
    right = np.cross(normal, axis)
    right /= np.linalg.norm(right)
    flat = triangles @ np.column_stack([right, np.cross(normal, right)])
    outline = convex_hull((x, y) for x, y in flat.reshape(-1, 2).tolist())
    across, along = flat[:, 1] - flat[:, 0], flat[:, 2] - flat[:, 0]
    filled = np.sum(across[:, 0] * along[:, 1] - across[:, 1] * along[:, 0])
    first = outline[0]
    whole = sum(twice_area(first, p, q) for p, q in pairwise(outline[1:]))
    return bool(filled > (1.0 - _FLAT) * whole)


def _plate(
    vertices: NDArray[np.float64], faces: NDArray[np.intp], normal: NDArray[np.float64]
) -> TriangleMesh:
    """The plate behind a patch: first the corners of its back, then those of the patch."""
    used, renumbered = np.unique(faces, return_inverse=True)
    back, count = renumbered.reshape(faces.shape), len(used)
    edges = sorted(map(tuple, back[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2).tolist()))
    rim = [(a, b) for a, b in edges if (b, a) not in edges]
    sides = [side for a, b in rim for side in ((a, b, b + count), (a, b + count, a + count))]
    front = vertices[used]
    shell = np.vstack([back[:, ::-1], back + count, sides]).astype(np.int32)
    return TriangleMesh(np.vstack([front - normal * THICKNESS, front]), shell)
