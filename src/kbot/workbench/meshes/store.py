"""Meshes of the scene by opaque ids, as triangles that the page reads without a parser.

The page never names a path, so nothing outside a scene can be asked for.
"""

from __future__ import annotations

import hashlib
import io
import json
import struct
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from kbot.model.meshes import MeshPart, Texture, load_mesh
from kbot.text import KbotError
from kbot.workbench.meshes.simplify import MOST_TRIANGLES, simplify, triangle_count


@dataclass(frozen=True, slots=True)
class Lightened:
    """A mesh file that is drawn with fewer triangles than it has."""

    before: int
    after: int


class MeshStore:
    """Mesh files and meshes in memory under ids that stand for their content."""

    def __init__(self) -> None:
        self._parts: dict[str, Sequence[MeshPart]] = {}
        self._packed: dict[str, bytes] = {}
        self._files: dict[str, tuple[Sequence[MeshPart], str]] = {}
        self.lightened: dict[str, Lightened] = {}
        """The very large mesh files by their path."""
        self.refused: frozenset[str] = frozenset()
        """Files that are not for the page."""

    def add_file(self, path: str) -> str:
        """The id of a mesh file's triangles, of fewer ones where they are very many.

        Raises:
            KbotError: the file cannot be read, or is not for the page.
        """
        if path in self.refused:
            raise KbotError(f"the mesh {path} lies outside the description's folders and all packages")
        parts = load_mesh(path).parts
        known, mesh = self._files.get(path, ((), ""))
        if known is parts:  # as long as the file does not change
            return mesh
        drawn, before = parts, triangle_count(parts)
        self.lightened.pop(path, None)
        if before > MOST_TRIANGLES:
            drawn = simplify(parts)
            self.lightened[path] = Lightened(before, triangle_count(drawn))
        mesh = self._add(drawn)
        self._files[path] = (parts, mesh)
        return mesh

    def add_triangles(self, vertices: NDArray[np.float64], faces: NDArray[np.integer]) -> str:
        """The id of triangles: `vertices` (n, 3) in metres, `faces` (m, 3) indices."""
        return self._add((MeshPart(vertices, faces.astype(np.int64), None),))

    def packed(self, mesh: str) -> bytes | None:
        """The triangles of an id, None when there is no such mesh.

        Little-endian: the length of a JSON head (uint32), the head padded to four bytes, then for
        each part in it `vertices` times three float32, `triangles` times three uint32 and, where it has an
        `image`, `vertices` times two float32 and that many bytes of a picture, padded to four bytes.
        """
        packed = self._packed.get(mesh)
        if packed is None and (parts := self._parts.get(mesh)) is not None:
            packed = self._packed[mesh] = _pack(parts)
        return packed

    def _add(self, parts: Sequence[MeshPart]) -> str:
        digest = hashlib.sha256()
        for part in parts:
            digest.update(part.vertices.tobytes())
            digest.update(part.faces.tobytes())
            digest.update(repr(part.rgba).encode())
            if part.texture is not None:
                digest.update(part.texture.uv.tobytes())
                digest.update(part.texture.image.tobytes())
        mesh = digest.hexdigest()[:24]
        self._parts.setdefault(mesh, parts)
        return mesh


def _pack(parts: Sequence[MeshPart]) -> bytes:
    images = [_image(part.texture) if part.texture else b"" for part in parts]
    heads = [
        {"vertices": len(p.vertices), "triangles": len(p.faces), "rgba": p.rgba, "image": len(image)}
        for p, image in zip(parts, images, strict=True)
    ]
    chunks = [_padded(json.dumps(heads).encode(), b" ")]
    chunks.insert(0, struct.pack("<I", len(chunks[0])))
    for part, image in zip(parts, images, strict=True):
        chunks.append(np.ascontiguousarray(part.vertices, dtype="<f4").tobytes())
        chunks.append(np.ascontiguousarray(part.faces, dtype="<u4").tobytes())
        if part.texture is not None:
            chunks.append(np.ascontiguousarray(part.texture.uv, dtype="<f4").tobytes())
            chunks.append(_padded(image, b"\0"))
    return b"".join(chunks)


def _padded(data: bytes, filling: bytes) -> bytes:
    return data + filling * (-len(data) % 4)


def _image(texture: Texture) -> bytes:
    """A photograph stays a JPEG, everything else becomes a PNG."""
    packed, image = io.BytesIO(), texture.image
    if image.format == "JPEG":
        image.convert("RGB").save(packed, "JPEG", quality=90)
    else:
        image.convert("RGBA" if image.has_transparency_data else "RGB").save(packed, "PNG")
    return packed.getvalue()
