"""Normals for smooth shading that keep edges sharp."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Index = NDArray[np.int64]

SHARP = math.radians(30.0)
"""Faces that meet at a larger angle keep a sharp edge between them."""
_MOST_PAIRS = 20_000_000
"""Meshes with more pairs of corners are shaded flat, which bounds the memory of the pairs."""


def face_normals(vertices: Array, faces: Index) -> Array:
    """Return the normals (m, 3) of triangles. Their length is twice the triangle's area."""
    a, b, c = vertices[faces[:, 0]], vertices[faces[:, 1]], vertices[faces[:, 2]]
    return np.cross(b - a, c - a)


def creased(vertices: Array, faces: Index) -> tuple[Array, Array, Index, Index]:
    """Return vertices, their unit normals, faces, and the index of the source vertex of each vertex.

    Triangles that meet at less than 30 degrees share a normal at their common vertex. The normal at a corner
    is the mean, weighted by area, of its own face and of the faces around the vertex within that angle.
    """
    normals = face_normals(vertices, faces)
    long = np.linalg.norm(normals, axis=1)
    units = normals / np.where(long > 0.0, long, 1.0)[:, None]
    corners = faces.reshape(-1)
    of_face = np.repeat(np.arange(len(faces)), 3)
    order = np.argsort(corners, kind="stable")
    counts = np.bincount(corners, minlength=len(vertices))
    smooth = units[of_face]
    if int((counts.astype(np.int64) ** 2).sum()) <= _MOST_PAIRS:
        first, second = _pairs(order, counts)
        near = (units[of_face[first]] * units[of_face[second]]).sum(axis=1) > math.cos(SHARP)
        first, second = first[near], second[near]
        summed = np.zeros((len(corners), 3))
        np.add.at(summed, first, normals[of_face[second]])
        length = np.linalg.norm(summed, axis=1)
        smooth = np.where(
            length[:, None] > 0.0, summed / np.where(length > 0.0, length, 1.0)[:, None], smooth
        )
    keys = np.concatenate([corners[:, None], np.round(smooth * 1e4).astype(np.int64)], axis=1)
    _, chosen, became = np.unique(keys, axis=0, return_index=True, return_inverse=True)
    sources = corners[chosen]
    return vertices[sources], smooth[chosen], became.reshape(-1, 3), sources


def _pairs(order: Index, counts: Index) -> tuple[Index, Index]:
    """Return all ordered pairs of corners at the same vertex."""
    starts = np.concatenate([[0], np.cumsum(counts)[:-1]])
    first = np.repeat(order, np.repeat(counts, counts))
    total = int((counts**2).sum())
    within = np.arange(total) - np.repeat(np.concatenate([[0], np.cumsum(counts**2)[:-1]]), counts**2)
    second = order[np.repeat(starts, counts**2) + within % np.repeat(np.maximum(counts, 1), counts**2)]
    return first, second
