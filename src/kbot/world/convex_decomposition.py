"""Splits hollow meshes into convex pieces, because the engine collides with convex hulls."""

from __future__ import annotations

from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from kbot.world.world import TriangleMesh

THICKNESS = 0.005
"""Thickness in m of the plate that replaces a triangle of a hollow surface. It is behind the triangle."""

MOST_PIECES = 4000
"""A mesh of more pieces collides as its convex hull."""
_FLAT = 1e-4
"""Distance, as a share of the mesh's size, up to which a vertex counts as on a face."""
_PRISM = np.array(
    [[0, 2, 1], [3, 4, 5], [0, 1, 4], [0, 4, 3], [1, 2, 5], [1, 5, 4], [2, 0, 3], [2, 3, 5]], dtype=np.int32
)
"""Faces of a prism with the corners 0 to 2 on one side and 3 to 5 on the other."""


@lru_cache(maxsize=64)
def convex_pieces(mesh: TriangleMesh) -> tuple[TriangleMesh, ...] | None:
    """Split a mesh into convex pieces.

    A convex mesh is returned as it is. Otherwise each connected part is a piece if it is convex. A part that
    is not becomes one thin plate per triangle. None if there would be more than `MOST_PIECES`.
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
    """A thin prism behind every triangle that has an area."""
    plates = []
    for triangle in vertices[faces]:
        normal = np.cross(triangle[1] - triangle[0], triangle[2] - triangle[0])
        length = float(np.linalg.norm(normal))
        if length > 1e-9:
            back = triangle - normal / length * THICKNESS
            plates.append(TriangleMesh(np.vstack([back, triangle]), _PRISM))
    return plates
