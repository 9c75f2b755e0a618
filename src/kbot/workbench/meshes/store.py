"""The meshes of a scene by opaque ids, as triangles that the page reads without a parser.

A page never sends a path, so it cannot request a file outside the scene.
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
    """Triangle counts of a simplified mesh file."""

    before: int
    after: int


class MeshStore:
    """Mesh files and meshes in memory, under ids that are derived from their content."""

    def __init__(self) -> None:
        self._parts: dict[str, Sequence[MeshPart]] = {}
        self._packed: dict[str, bytes] = {}
        self._files: dict[str, tuple[Sequence[MeshPart], str]] = {}
        self.lightened: dict[str, Lightened] = {}
        """The simplified mesh files by path."""
        self.refused: frozenset[str] = frozenset()
        """Files that the page may not load."""
        self.simplified: dict[str, tuple[MeshPart, ...]] = {}
        """Files with very many triangles that were simplified when they were read, until they are added."""

    def add_file(self, path: str) -> str:
        """Return the id of a mesh file's triangles, which are simplified if there are very many.

        Raises:
            KbotError: the file cannot be read, or the page may not load it.
        """
        if path in self.refused:
            raise KbotError(f"the mesh {path} is outside the description's folders and all packages")
        parts = load_mesh(path).parts
        known, mesh = self._files.get(path, ((), ""))
        if known is parts:  # the file has not changed
            return mesh
        drawn, before = parts, triangle_count(parts)
        self.lightened.pop(path, None)
        if before > MOST_TRIANGLES:
            drawn = self.simplified.pop(path, ()) or simplify(parts)
            self.lightened[path] = Lightened(before, triangle_count(drawn))
        mesh = self._add(drawn)
        self._files[path] = (parts, mesh)
        return mesh

    def add_triangles(self, vertices: NDArray[np.float64], faces: NDArray[np.integer]) -> str:
        """Return the id of triangles: `vertices` (n, 3) in metres, `faces` (m, 3) indices."""
        return self._add((MeshPart(vertices, faces.astype(np.int64), None),))

    def packed(self, mesh: str) -> bytes | None:
        """Return the triangles of an id, or None if there is no such mesh.

        The format is little-endian: the length of a JSON head (uint32), then the head padded to four bytes.
        For each part in it follow `vertices` times three float32 and `triangles` times three uint32. A part
        with an `image` continues with `vertices` times two float32 and that many bytes of an image, padded to
        four bytes.
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
    """Encode a texture: photographs as JPEG, everything else as PNG."""
    packed, image = io.BytesIO(), texture.image
    if texture.format == "JPEG":
        image.convert("RGB").save(packed, "JPEG", quality=90)
    else:
        image.convert("RGBA" if image.has_transparency_data else "RGB").save(packed, "PNG")
    return packed.getvalue()
