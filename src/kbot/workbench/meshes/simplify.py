"""Simplify meshes with very many triangles for display. Physics and checks use the original mesh."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from kbot.model.meshes import MeshPart, Texture

MOST_TRIANGLES = 200_000
"""Triangles of a mesh file above which it is simplified."""
WANTED_TRIANGLES = 100_000
"""Triangles of a simplified mesh file, about."""
_SMALL_PART = 500  # simplifying a part with so few triangles is not worth the loss


def triangle_count(parts: Sequence[MeshPart]) -> int:
    return sum(len(part.faces) for part in parts)


def simplify(parts: Sequence[MeshPart], wanted: int = WANTED_TRIANGLES) -> tuple[MeshPart, ...]:
    """Reduce parts to about `wanted` triangles in all.

    It collapses the edges with the least visible loss (quadric error metrics: Garland and Heckbert, 1997).
    """
    kept = min(1.0, wanted / max(1, triangle_count(parts)))
    return tuple(_lighter(part, kept) if len(part.faces) > _SMALL_PART else part for part in parts)


def _lighter(part: MeshPart, kept: float) -> MeshPart:
    import fast_simplification  # imported lazily: few meshes are that large
    import trimesh

    vertices, faces, texture = part.vertices, part.faces, part.texture
    if texture is None:  # STL repeats the corners of each triangle: join them, so that edges can collapse
        joined = trimesh.Trimesh(vertices, faces, process=False)
        joined.merge_vertices()
        vertices, faces = joined.vertices, joined.faces
    points = np.ascontiguousarray(vertices, dtype=np.float32)
    corners = np.ascontiguousarray(faces, dtype=np.int32)
    fewer, left, collapses = fast_simplification.simplify(
        points, corners, target_reduction=1.0 - kept, return_collapses=True
    )
    if texture is not None:
        _, _, became = fast_simplification.replay_simplification(points, corners, collapses)
        uv = np.zeros((len(fewer), 2))  # the mean of the vertices that were merged
        np.add.at(uv, became, texture.uv)
        uv /= np.maximum(np.bincount(became, minlength=len(fewer)), 1)[:, None]
        texture = Texture(uv, texture.image, texture.format)
    return MeshPart(np.asarray(fewer, np.float64), np.asarray(left, np.int64), part.rgba, texture)
