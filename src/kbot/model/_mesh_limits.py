"""Limits mesh files, so that a small file cannot fill the memory or take minutes."""

from __future__ import annotations

import errno
import json
import re
import struct
from collections.abc import Iterator
from functools import cache
from io import BytesIO
from pathlib import Path
from xml.etree import ElementTree as ET
from zipfile import is_zipfile

from kbot.text.files import read_bytes

MB = 1_000_000
MOST_JSON_BYTES = 20 * MB
"""Size of a glTF description: `{"":0}` repeated takes 32 MB of memory per MB."""
# Each limit keeps `info`, `check` and `export` below 10 s of CPU time and 1 GB of memory. The figures were
# measured with the most expensive content found for the format, on a busy machine with slow cores.
MOST_BYTES = {
    "stl": 50 * MB + 84,  # a binary file with a million triangles takes 0.4 GB; text takes 0.5 GB and 3 s
    "obj": 24 * MB,  # mixed triangles and quads take 0.32 s per MB; a face with all vertices 32 MB per MB
    "dae": 32 * MB,  # MOST_WORDS limits its expensive parts
    "ply": 64 * MB,  # a binary file with a million triangles has 19 MB without normals and colours
    "glb": 64 * MB,  # MOST_JSON_BYTES and MOST_CORNERS limit its expensive parts
    "gltf": MOST_JSON_BYTES,
}
MOST_NAMED_BYTES = 64 * MB
"""Size of all files that a mesh file refers to, buffers and textures, which stay in memory."""
MOST_TRIANGLES = 1_000_000
"""Real robot meshes have fewer. The loader takes 0.4 GB for an STL of this size."""
MOST_CORNERS = 6 * MOST_TRIANGLES
"""Vertices plus corners of triangles. An STL has three of each per triangle."""
MOST_TEXT_BYTES = 24 * MB
MOST_LINES = 500_000
"""Size and lines of a text PLY. The loader creates an array per line: a million take 1 GB and 6 s."""
MOST_HEADER_BYTES = 1 << 16
"""Size of the longest header of a PLY file. Real headers have less than 2 kB."""
MOST_WORDS = 5_000_000
"""Spaces, line breaks and tags of a COLLADA file. Three indices are a triangle, which takes 500 bytes."""
MOST_PLACEMENTS = 10_000
"""Nodes and geometries of a scene. The loader takes up to 0.2 ms for each."""
MOST_ACCESSORS = 40_000
"""Accessors of a glTF file: four for each primitive."""
MOST_MASKED = 300_000_000
"""Materials times vertices of an OBJ. The loader visits all vertices for each material, at 10 ns each."""
MOST_TEXELS = 64_000_000
"""Pixels of all textures of a file. They take 256 MB of memory."""


class MeshTooLarge(ValueError):
    """Loading a mesh file would take too much time or memory."""


def check_costs(path: str, extension: str) -> None:
    """Check the sizes that a file declares, before the loader uses them.

    Raises:
        MeshTooLarge: loading would take too much time or memory.
        ValueError: the file is damaged, or uses a feature that no mesh needs.
    """
    data = _read(path, MOST_BYTES[extension])
    _CHECKS[extension](data)


def _read(path: str, limit: int) -> bytes:
    try:
        return read_bytes(path, limit)
    except OSError as error:
        if error.errno != errno.EFBIG:
            raise
        raise _too_large(Path(path).stat().st_size, "bytes", limit) from None


def _too_large(count: int, what: str, limit: int) -> MeshTooLarge:
    return MeshTooLarge(f"it has {count} {what}, more than {limit}. Simplify the mesh")


def _check_count(count: int, what: str, limit: int = MOST_PLACEMENTS) -> None:
    if count > limit:
        raise _too_large(count, what, limit)


def _check_stl(data: bytes) -> None:
    _check_count(data.count(b"endsolid"), "solids")
    # in a text file, each vertex takes 180 bytes, even without coordinates
    _check_count(data.lower().count(b"vertex"), "vertices", 3 * MOST_TRIANGLES)


def _check_ply(data: bytes) -> None:
    """Check the counts in the header, and the size of a text file."""
    end = re.search(rb"(?<!\S)end_header(?!\S)", data[:MOST_HEADER_BYTES])
    if end is None:
        raise ValueError(f"its header does not end within {MOST_HEADER_BYTES} bytes")
    lines = data[: end.start()].split(b"\n")
    for words in map(bytes.split, lines):
        if len(words) == 3 and b"element" in words[0]:
            limit = MOST_TRIANGLES if words[1] == b"face" else 3 * MOST_TRIANGLES
            _check_count(int(words[2]), f"elements '{words[1].decode()}'", limit)
    if b"ascii" in lines[1].lower():  # the loader looks in this line
        _check_count(len(data), "bytes of text", MOST_TEXT_BYTES)
        _check_count(len(data.decode().splitlines()), "lines of text", MOST_LINES)


def _check_obj(data: bytes) -> None:
    _check_count(data.count(b"\nf "), "faces", MOST_TRIANGLES)
    _check_count(data.count(b"\nv "), "vertices", 3 * MOST_TRIANGLES)
    materials = len(set(re.findall(rb"^[ \t]*usemtl\b(.*)", data, re.MULTILINE)))
    _check_count(materials, "materials")
    if materials * data.count(b"\nv ") > MOST_MASKED:
        raise MeshTooLarge(
            f"it has {materials} materials, too many for its number of vertices. Merge the materials"
        )


def _check_collada(data: bytes) -> None:
    if is_zipfile(BytesIO(data)):
        raise ValueError("it is an archive. Unpack it")
    text = data.replace(b"\0", b"")  # so that UTF-16 is searched too
    if b"<!ENTITY" in text:
        raise ValueError("it declares XML entities")
    _check_count(len(re.findall(rb"<(\w+:)?(polylist|polygons|lines|tri)", text)), "primitives")
    _check_count(sum(map(text.count, (b" ", b"\t", b"\n", b"\r", b"<"))), "words", MOST_WORDS)
    if b"instance_node" in text:
        _check_count(len(re.findall(rb"<(?:\w+:)?(?:instance_)?node\b", text)), "nodes")
        _check_count(_placements(ET.fromstring(data)), "nodes")


def _placements(root: ET.Element) -> int:
    """The number of nodes that the loader creates. A node may place another one many times, recursively."""
    nodes = {f"#{node.get('id')}": node for node in root.iter() if _tag(node) == "node"}

    @cache
    def placed_by(url: str) -> int:
        return count(nodes[url]) if url in nodes else 0

    def count(node: ET.Element) -> int:
        children = ((child, _tag(child)) for child in node)
        return 1 + sum(
            count(child) if tag == "node" else placed_by(child.get("url", ""))
            for child, tag in children
            if tag in ("node", "instance_node")
        )

    return sum(count(scene) for scene in root.iter() if _tag(scene) == "visual_scene")


def _tag(element: ET.Element) -> str:
    return str(element.tag).rpartition("}")[2]


def _check_glb(data: bytes) -> None:
    """Check the description in a binary glTF file. The loader reports a damaged file."""
    if len(data) >= 20:
        (length,) = struct.unpack_from("<I", data, 12)
        _check_gltf(data[20 : 20 + length])


def _check_gltf(data: bytes) -> None:
    """Check the counts in a glTF description.

    An accessor without a buffer is filled with zeros, as many as it declares. A node places a whole mesh, and
    each primitive copies its accessors.
    """
    _check_count(len(data), "bytes of JSON", MOST_JSON_BYTES)
    content = json.loads(data)
    placed = 0
    meshes = [len(_dicts(mesh, "primitives")) for mesh in _dicts(content, "meshes")]
    for node in _dicts(content, "nodes"):
        mesh = node.get("mesh")
        placed += 1 + (meshes[mesh] if isinstance(mesh, int) and 0 <= mesh < len(meshes) else 0)
    _check_count(placed + sum(meshes), "nodes and primitives")
    accessors = _dicts(content, "accessors")
    _check_count(len(accessors), "accessors", MOST_ACCESSORS)
    counts = [abs(count) if isinstance(count := accessor.get("count"), int) else 0 for accessor in accessors]
    made = [count for count, accessor in zip(counts, accessors, strict=True) if "bufferView" not in accessor]
    made += (counts[index] for index in _used(content) if 0 <= index < len(counts))
    _check_count(sum(made), "vertices and corners of triangles", MOST_CORNERS)


def _used(content: object) -> Iterator[int]:
    """The accessors of the primitives' vertices and indices."""
    for mesh in _dicts(content, "meshes"):
        for primitive in _dicts(mesh, "primitives"):
            attributes = primitive.get("attributes")
            position = attributes.get("POSITION") if isinstance(attributes, dict) else None
            yield from (i for i in (position, primitive.get("indices")) if isinstance(i, int))


def _dicts(holder: object, name: str) -> list[dict[str, object]]:
    """The objects in a list of glTF. The loader rejects other values."""
    found = holder.get(name) if isinstance(holder, dict) else None
    return [item for item in found if isinstance(item, dict)] if isinstance(found, list) else []


_CHECKS = {
    "stl": _check_stl,
    "obj": _check_obj,
    "dae": _check_collada,
    "ply": _check_ply,
    "gltf": _check_gltf,
    "glb": _check_glb,
}
