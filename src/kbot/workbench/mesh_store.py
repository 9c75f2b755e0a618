"""Meshes that the scene names, by opaque ids, as triangles the page reads without a parser.

The page never names a path, so nothing outside a scene can be asked for.
"""

from __future__ import annotations

import hashlib
import json
import struct
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from kbot.model.meshes import MeshPart, load_mesh


class MeshStore:
    """Mesh files and meshes in memory under ids that stand for their content."""

    def __init__(self) -> None:
        self._parts: dict[str, Sequence[MeshPart]] = {}

    def add_file(self, path: str) -> str:
        """The id of a mesh file's triangles.

        Raises:
            KbotError: the file cannot be read.
        """
        return self._add(load_mesh(path).parts)

    def add_triangles(self, vertices: NDArray[np.float64], faces: NDArray[np.integer]) -> str:
        """The id of triangles: `vertices` (n, 3) in metres, `faces` (m, 3) indices."""
        return self._add((MeshPart(vertices, faces.astype(np.int64), None),))

    def packed(self, mesh: str) -> bytes | None:
        """The triangles of an id, None when there is no such mesh.

        Little-endian: the length of a JSON head (uint32), the head padded to four bytes, then for
        each part in it `vertices` times three float32 and `triangles` times three uint32.
        """
        parts = self._parts.get(mesh)
        return None if parts is None else _pack(parts)

    def _add(self, parts: Sequence[MeshPart]) -> str:
        digest = hashlib.sha256()
        for part in parts:
            digest.update(part.vertices.tobytes())
            digest.update(part.faces.tobytes())
            digest.update(repr(part.rgba).encode())
        mesh = digest.hexdigest()[:24]
        self._parts.setdefault(mesh, parts)
        return mesh


def _pack(parts: Sequence[MeshPart]) -> bytes:
    head = json.dumps(
        [{"vertices": len(p.vertices), "triangles": len(p.faces), "rgba": p.rgba} for p in parts]
    ).encode()
    head += b" " * (-len(head) % 4)
    chunks = [struct.pack("<I", len(head)), head]
    for part in parts:
        chunks.append(np.ascontiguousarray(part.vertices, dtype="<f4").tobytes())
        chunks.append(np.ascontiguousarray(part.faces, dtype="<u4").tobytes())
    return b"".join(chunks)
