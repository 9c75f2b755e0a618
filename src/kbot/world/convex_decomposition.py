"""Splits hollow meshes into convex pieces, because the engine collides with convex hulls."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from functools import lru_cache
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from kbot.kinematics.planar import Point, convex_hull, twice_area
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
            pieces.append(TriangleMesh(own, own_faces.astype(np.int32), is_piece=True))
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
    starts = [0, *range(16, len(normal), 256)]  # a few of the faces show that most hollow meshes are not
    for rows in map(slice, starts, [*starts[1:], len(normal)]):
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
    faces, normals, areas = faces[kept], normals[kept] / areas[kept, None], areas[kept]
    return [
        _plate(vertices, faces[patch], normals[patch[0]])
        for patch in _patches(vertices, faces, normals, areas)
    ]


def _patches(
    vertices: NDArray[np.float64],
    faces: NDArray[np.intp],
    normals: NDArray[np.float64],
    areas: NDArray[np.float64],
) -> Iterator[list[int]]:
    """Split the triangles into patches that are flat and convex. Each grows by one neighbour at a time.

    `areas` are twice those of the triangles. Plain numbers are faster here than arrays of three.
    """
    at_edge: dict[tuple[int, int], list[int]] = {}
    corners: list[tuple[int, int, int]] = list(map(tuple, faces.tolist()))
    for index, (a, b, c) in enumerate(corners):
        for edge in ((a, b), (b, c), (c, a)):
            at_edge.setdefault(edge, []).append(index)
    right = np.cross(normals, np.eye(3)[np.abs(normals).argmin(axis=1)])
    right /= np.linalg.norm(right, axis=1)[:, None]
    planes = np.hstack([right, np.cross(normals, right)]).tolist()
    points, across, twice = vertices.tolist(), normals.tolist(), areas.tolist()
    free = dict.fromkeys(range(len(faces)))
    while free:
        seed = next(iter(free))
        del free[seed]
        (nx, ny, nz), plane = across[seed], planes[seed]
        patch, tried = [seed], set[int]()
        filled, outline = twice[seed], {i: _on_plane(points[i], plane) for i in corners[seed]}
        waiting = [seed]
        while waiting:
            a, b, c = corners[waiting.pop()]
            # a neighbour of the same side has the edge in the other direction
            for other in (i for edge in ((b, a), (c, b), (a, c)) for i in at_edge.get(edge, ())):
                x, y, z = across[other]
                if other not in free or other in tried or x * nx + y * ny + z * nz < _PARALLEL:
                    continue
                tried.add(other)
                if len(patch) == _MOST_TRIANGLES:
                    continue
                more = outline | {i: _on_plane(points[i], plane) for i in corners[other] if i not in outline}
                # triangles in a plane are convex if they fill their convex outline
                if filled + twice[other] > (1.0 - _FLAT) * _twice_area_of_outline(more.values()):
                    del free[other]
                    patch.append(other)
                    waiting.append(other)
                    filled, outline = filled + twice[other], more
                    tried.clear()  # it may make a neighbour convex that was not
        yield patch


def _on_plane(point: Sequence[float], plane: Sequence[float]) -> Point:
    """A point in the two axes of a plane."""
    x, y, z = point
    a, b, c, d, e, f = plane
    return a * x + b * y + c * z, d * x + e * y + f * z


def _twice_area_of_outline(points: Iterable[Point]) -> float:
    first, *others = convex_hull(points)
    return sum(twice_area(first, p, q) for p, q in pairwise(others))


def _plate(
    vertices: NDArray[np.float64], faces: NDArray[np.intp], normal: NDArray[np.float64]
) -> TriangleMesh:
    """The plate behind a patch: first the corners of its back, then those of the patch."""
    corners = faces.ravel().tolist()
    used = sorted(set(corners))
    number = {index: n for n, index in enumerate(used)}
    count = len(used)
    back = [number[index] for index in corners]
    triangles = list(zip(back[::3], back[1::3], back[2::3], strict=True))
    edges = {edge for a, b, c in triangles for edge in ((a, b), (b, c), (c, a))}
    shell = [(c, b, a) for a, b, c in triangles]
    shell += [(a + count, b + count, c + count) for a, b, c in triangles]
    for a, b in sorted(edges):
        if (b, a) not in edges:
            shell += [(a, b, b + count), (a, b + count, a + count)]
    front = vertices[used]
    corners_of_both = np.vstack([front - normal * THICKNESS, front])
    return TriangleMesh(corners_of_both, np.array(shell, dtype=np.int32), is_piece=True)
