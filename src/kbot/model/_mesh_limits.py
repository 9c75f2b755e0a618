"""What a mesh file may cost: a small file must not fill the memory, or keep a processor busy for minutes."""

from __future__ import annotations

import json
import re
import struct
from functools import cache
from io import BytesIO
from pathlib import Path
from xml.etree import ElementTree as ET
from zipfile import is_zipfile

MOST_BYTES = 256 * 1024 * 1024
"""Of a mesh file, and of all files that it names."""
MOST_CORNERS = 12_000_000
"""Vertices, and corners of triangles: an STL of two million triangles takes 0.5 GB while it is read."""
MOST_PLACEMENTS = 10_000
"""Nodes of a scene and geometries in it; the loader takes up to 0.2 ms for each."""
MOST_MASKED = 300_000_000
"""Materials times vertices of an OBJ: the loader looks at all vertices for each material, at 10 ns each."""
MOST_TEXELS = 64_000_000
"""Pixels of a texture, and of all textures of a file as they are kept: 256 MB."""


class TooLarge(ValueError):
    """A mesh file would cost more than a mesh may."""


def check_costs(path: str, extension: str) -> None:
    """Look at what a file claims before the loader believes it.

    Raises:
        TooLarge: it would cost more than a mesh may.
        ValueError: it is broken, or uses what no mesh needs.
    """
    size = Path(path).stat().st_size
    if size > MOST_BYTES:
        raise TooLarge(f"it has {size} bytes, more than {MOST_BYTES}")
    if extension in ("gltf", "glb"):
        _check_gltf(_json_of(Path(path)))
    elif extension in _CHECKS:
        _CHECKS[extension](Path(path).read_bytes())


def _check_count(count: int, what: str) -> None:
    if count > MOST_PLACEMENTS:
        raise TooLarge(f"it has {count} {what}, more than {MOST_PLACEMENTS}")


def _check_stl(data: bytes) -> None:
    _check_count(data.count(b"endsolid"), "solids")


def _check_obj(data: bytes) -> None:
    materials = len(set(re.findall(rb"^[ \t]*usemtl\b(.*)", data, re.MULTILINE)))
    _check_count(materials, "materials")
    if materials * data.count(b"\nv ") > MOST_MASKED:
        raise TooLarge(f"it has {materials} materials, too many for so many vertices")


def _check_collada(data: bytes) -> None:
    if is_zipfile(BytesIO(data)):
        raise ValueError("it is an archive: unpack it")
    text = data.replace(b"\0", b"")  # of UTF-16 too
    if b"<!ENTITY" in text:
        raise ValueError("it declares XML entities")
    _check_count(len(re.findall(rb"<(\w+:)?(polylist|polygons|lines|tri)", text)), "primitives")
    if b"instance_node" in text:
        _check_count(_placements(ET.fromstring(data)), "nodes")


def _placements(root: ET.Element) -> int:
    """How many nodes the loader will make: one may place another many times, which may do so too."""
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


def _json_of(file: Path) -> object:
    """The description in a glTF file; None where a binary one is broken, which the loader reports."""
    if file.suffix.lower() == ".gltf":
        return json.loads(file.read_bytes())
    with file.open("rb") as stream:
        head = stream.read(20)
        if len(head) < 20:
            return None
        (length,) = struct.unpack_from("<I", head, 12)
        return json.loads(stream.read(length)) if length <= file.stat().st_size else None


def _check_gltf(content: object) -> None:
    """An accessor without a buffer is made of zeros, as many as it claims; a node places a whole mesh."""
    claimed, placed = 0, 0
    meshes = [len(_dicts(mesh, "primitives")) for mesh in _dicts(content, "meshes")]
    for node in _dicts(content, "nodes"):
        mesh = node.get("mesh")
        placed += 1 + (meshes[mesh] if isinstance(mesh, int) and 0 <= mesh < len(meshes) else 0)
    _check_count(placed + sum(meshes), "nodes and primitives")
    for accessor in _dicts(content, "accessors"):
        count = accessor.get("count")
        if "bufferView" not in accessor and isinstance(count, int):
            claimed += abs(count)
    if claimed > MOST_CORNERS:
        raise TooLarge(f"it has accessors without a buffer, of {claimed} values")


def _dicts(holder: object, name: str) -> list[dict[str, object]]:
    """The objects in a list of glTF; what is none of them the loader rejects."""
    found = holder.get(name) if isinstance(holder, dict) else None
    return [item for item in found if isinstance(item, dict)] if isinstance(found, list) else []


_CHECKS = {"stl": _check_stl, "obj": _check_obj, "dae": _check_collada}
