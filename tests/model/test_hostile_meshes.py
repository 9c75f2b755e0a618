"""Tests mesh files with false sizes: each is one clear error, before it fills the memory."""

import base64
import json
import re
import struct
import zipfile
import zlib
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from kbot.model.meshes import MOST_PIXELS, load_mesh
from kbot.text import KbotError

from .test_meshes import COLLADA

POINTS = (0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0)
NAN = float("nan")


def ply(points: tuple[float, ...], indices: tuple[int, ...], vertices: int = 3, faces: int = 1) -> bytes:
    head = (
        "ply\nformat binary_little_endian 1.0\n"
        f"element vertex {vertices}\nproperty float x\nproperty float y\nproperty float z\n"
        f"element face {faces}\nproperty list uchar int vertex_indices\nend_header\n"
    )
    return head.encode() + struct.pack("<9f", *points) + struct.pack("<B3i", 3, *indices)


def description(
    points: tuple[float, ...], indices: tuple[int, ...], uri: str | None, **changed: Any
) -> tuple[dict[str, Any], bytes]:
    data = struct.pack("<9f", *points) + struct.pack("<3I", *indices)
    buffer: dict[str, Any] = {"byteLength": len(data)} | ({"uri": uri} if uri else {})
    content = {
        "asset": {"version": "2.0"},
        "scenes": [{"nodes": [0]}],
        "nodes": [{"mesh": 0}],
        "meshes": [{"primitives": [{"attributes": {"POSITION": 0}, "indices": 1}]}],
        "buffers": [buffer],
        "bufferViews": [
            {"buffer": 0, "byteOffset": 0, "byteLength": 36},
            {"buffer": 0, "byteOffset": 36, "byteLength": 12},
        ],
        "accessors": [
            {"bufferView": 0, "componentType": 5126, "count": 3, "type": "VEC3"},
            {"bufferView": 1, "componentType": 5125, "count": 3, "type": "SCALAR"},
        ],
    }
    return content | changed, data


def gltf(points: tuple[float, ...], indices: tuple[int, ...], uri: str = "", **changed: Any) -> bytes:
    _, data = description(points, indices, None)
    uri = uri or "data:application/octet-stream;base64," + base64.b64encode(data).decode()
    return json.dumps(description(points, indices, uri, **changed)[0]).encode()


def glb(points: tuple[float, ...], indices: tuple[int, ...], **changed: Any) -> bytes:
    content, data = description(points, indices, None, **changed)
    text = json.dumps(content).encode()
    text += b" " * (-len(text) % 4)
    chunks = struct.pack("<I4s", len(text), b"JSON") + text + struct.pack("<I4s", len(data), b"BIN\0") + data
    return struct.pack("<4sII", b"glTF", 2, 12 + len(chunks)) + chunks


def obj(points: tuple[float, ...], indices: tuple[int, ...]) -> bytes:
    places = "".join(f"v {points[i]} {points[i + 1]} {points[i + 2]}\n" for i in (0, 3, 6))
    return (places + "f " + " ".join(str(index + 1) for index in indices)).encode()


def stl(points: tuple[float, ...], indices: tuple[int, ...]) -> bytes:
    return b" " * 80 + struct.pack("<I12fH", 1, 0.0, 0.0, 1.0, *points, 0)


def dae(points: tuple[float, ...], indices: tuple[int, ...]) -> bytes:
    text = COLLADA.replace("0 0 0 100 0 0 0 0 50", " ".join(map(str, points)))
    return text.replace("<p>0 1 2</p>", f"<p>{' '.join(map(str, indices))}</p>").encode()


FORMATS: dict[str, Callable[..., bytes]] = {
    "ply": ply,
    "gltf": gltf,
    "glb": glb,
    "obj": obj,
    "stl": stl,
    "dae": dae,
}


def load(folder: Path, extension: str, content: bytes) -> Any:
    file = folder / f"a.{extension}"
    file.write_bytes(content)
    return load_mesh(str(file))


@pytest.mark.parametrize("extension", FORMATS)
def test_the_unchanged_files_of_these_tests_are_valid_meshes(tmp_path: Path, extension: str) -> None:
    assert load(tmp_path, extension, FORMATS[extension](POINTS, (0, 1, 2))).faces.tolist() == [[0, 1, 2]]


@pytest.mark.parametrize("index", [3, 99, 2**31 - 1])
@pytest.mark.parametrize("extension", [name for name in FORMATS if name != "stl"])  # STL has no indices
def test_an_index_out_of_range_is_an_error(tmp_path: Path, extension: str, index: int) -> None:
    message = f"triangle with vertex index {index}, but only 3|out of bounds|no triangle"
    with pytest.raises(KbotError, match=message):
        load(tmp_path, extension, FORMATS[extension](POINTS, (0, 1, index)))


def test_a_negative_index_is_an_error(tmp_path: Path) -> None:
    with pytest.raises(KbotError, match=r"a\.ply has a triangle with vertex index -1, but only 3 vertices"):
        load(tmp_path, "ply", ply(POINTS, (0, 1, -1)))


def test_a_collada_vertex_that_is_not_finite_is_an_error(tmp_path: Path) -> None:
    with pytest.raises(KbotError, match="a vertex that is not finite"):
        load(tmp_path, "dae", dae((float("inf"), *POINTS[1:]), (0, 1, 2)))


@pytest.mark.parametrize("extension", [name for name in FORMATS if name not in ("obj", "dae")])
@pytest.mark.parametrize("value", [NAN, float("inf"), 3e38])
def test_a_vertex_beyond_the_limit_is_an_error(tmp_path: Path, extension: str, value: float) -> None:
    with pytest.raises(KbotError, match=r"a vertex that is not finite|a vertex at 3e"):
        load(tmp_path, extension, FORMATS[extension]((value, *POINTS[1:]), (0, 1, 2)))


@pytest.mark.parametrize(
    "head", [{"vertices": 1_000_000_000}, {"faces": 1_000_000_000}, {"vertices": 2**64}, {"vertices": -1}]
)
def test_a_header_that_declares_too_much_is_an_error(tmp_path: Path, head: dict[str, int]) -> None:
    with pytest.raises(KbotError, match=r"cannot be read|no triangle"):
        load(tmp_path, "ply", ply(POINTS, (0, 1, 2), **head))


@pytest.mark.parametrize("extension", ["gltf", "glb"])
def test_an_accessor_without_a_buffer_is_limited(tmp_path: Path, extension: str) -> None:
    claim = [
        {"componentType": 5126, "count": 1_000_000_000, "type": "VEC3"},
        {"bufferView": 1, "componentType": 5125, "count": 3, "type": "SCALAR"},
    ]
    with pytest.raises(KbotError, match=r"it has \d+ vertices and corners of triangles, more than"):
        load(tmp_path, extension, FORMATS[extension](POINTS, (0, 1, 2), accessors=claim))


def test_a_mesh_that_is_placed_too_often_is_an_error(tmp_path: Path) -> None:
    nodes = [{"children": list(range(1, 20_001))}, *({"mesh": 0} for _ in range(20_000))]
    with pytest.raises(KbotError, match="nodes and primitives, more than"):
        load(tmp_path, "glb", glb(POINTS, (0, 1, 2), nodes=nodes))


def test_nodes_that_place_nodes_are_counted_first(tmp_path: Path) -> None:
    """Each of 30 nodes places the next one twice: 2^31 - 1 nodes, plus the scene's two."""
    chain = "".join(
        f'<node id="n{i}"><instance_node url="#n{i + 1}"/><instance_node url="#n{i + 1}"/></node>'
        for i in range(30)
    )
    library = f'<library_nodes>{chain}<node id="n30"/></library_nodes>'
    text = COLLADA.replace("<library_visual_scenes>", f"{library}<library_visual_scenes>")
    text = text.replace("<translate>0 0 10</translate>", '<instance_node url="#n0"/>')
    with pytest.raises(KbotError, match=f"it has {2**31 + 1} nodes"):
        load(tmp_path, "dae", text.encode())
    loop = text.replace('url="#n1"', 'url="#n0"')
    with pytest.raises(KbotError, match="cannot be read"):
        load(tmp_path, "dae", loop.encode())


@pytest.mark.parametrize("encoding", ["utf-8", "utf-16"])
def test_entities_are_rejected(tmp_path: Path, encoding: str) -> None:
    head = f'<?xml version="1.0" encoding="{encoding}"?>'
    text = head + '<!DOCTYPE c [<!ENTITY a SYSTEM "file:///etc/passwd">]>' + COLLADA.partition("?>")[2]
    with pytest.raises(KbotError, match="it declares XML entities"):
        load(tmp_path, "dae", text.encode(encoding))


def test_an_archive_is_not_unpacked(tmp_path: Path) -> None:
    with zipfile.ZipFile(tmp_path / "a.dae", "w", zipfile.ZIP_DEFLATED) as archive:
        archive.writestr("a.dae", b" " * (1 << 24))
    with pytest.raises(KbotError, match="it is an archive"):
        load_mesh(str(tmp_path / "a.dae"))


@pytest.mark.parametrize(
    ("extension", "content", "message"),
    [
        ("stl", b"solid a\nfacet\nendsolid\n" * 20_000, "it has 20000 solids"),
        ("obj", b"".join(b"usemtl m%d\nf 1 2 3\n" % i for i in range(20_000)), "it has 20000 materials"),
        ("obj", b"\nv 0 0 0" * 100_000 + b"".join(b"\nusemtl m%d" % i for i in range(5000)), "too many for"),
        ("dae", COLLADA.encode().replace(b"<scene>", b"<triangles/>" * 20_000), "it has 20001 primitives"),
    ],
)
def test_contents_that_take_minutes_are_an_error(
    tmp_path: Path, extension: str, content: bytes, message: str
) -> None:
    with pytest.raises(KbotError, match=message):
        load(tmp_path, extension, content)


def test_a_huge_file_is_not_read(tmp_path: Path) -> None:
    with (tmp_path / "a.stl").open("wb") as file:
        file.truncate(1 << 40)  # a sparse file: a terabyte of zeros
    with pytest.raises(KbotError, match="it has 1099511627776 bytes, more than"):
        load_mesh(str(tmp_path / "a.stl"))


PLY_TEXT = ply(POINTS, (0, 1, 2)).partition(b"end_header")[0].replace(b"binary_little_endian", b"ascii")
HIDDEN = PLY_TEXT.replace(b"\nelement", b"\ncomment " + b"a" * 70_000 + b"\nelement", 1) + b"end_header\n"
PRIMITIVE = {"attributes": {"POSITION": 0}, "indices": 1}
EXPENSIVE = {
    "bytes of a glTF description": ("gltf", b'{"a":[' + b"{}," * 7_000_000 + b"0]}", "bytes"),
    "lines of a PLY": ("ply", PLY_TEXT + b"end_header\n" + b"\n" * 600_000, "lines of text"),
    "faces of a PLY": ("ply", ply(POINTS, (0, 1, 2), faces=1_000_001), "1000001 elements 'face'"),
    "faces of an OBJ": ("obj", b"v 0 0 0" + b"\nf 1 1 1" * 1_000_001, "1000001 faces"),
    "triangles of an STL": ("stl", bytes(80) + struct.pack("<I", 1_000_001) + bytes(50_000_050), "bytes"),
    "nodes of a COLLADA file": (
        "dae",
        COLLADA.encode().replace(b"<scene>", b'<node><instance_node url="#n"/></node>' * 10_000 + b"<scene>"),
        "20001 nodes",
    ),
    "indices of a COLLADA file": (
        "dae",
        COLLADA.encode().replace(b"<p>", b"<p>" + b"0 " * 5_000_000),
        "words",
    ),
    "copies of an accessor": (
        "glb",
        glb(
            POINTS,
            (0, 1, 2),
            meshes=[{"primitives": [PRIMITIVE] * 3}],
            accessors=[
                {"bufferView": 0, "componentType": 5126, "count": 2_000_001, "type": "VEC3"},
                {"bufferView": 1, "componentType": 5125, "count": 3, "type": "SCALAR"},
            ],
        ),
        "6000012 vertices and corners",
    ),
}


def test_a_header_cannot_hide_its_counts(tmp_path: Path) -> None:
    with pytest.raises(KbotError, match="its header does not end within 65536 bytes"):
        load(tmp_path, "ply", HIDDEN)


@pytest.mark.parametrize("what", EXPENSIVE)
def test_an_expensive_mesh_is_an_error_before_it_is_loaded(
    tmp_path: Path, what: str, measured_kbot: Callable[..., Any]
) -> None:
    extension, content, message = EXPENSIVE[what]
    (tmp_path / f"a.{extension}").write_bytes(content)
    geometry = f'<geometry><mesh filename="a.{extension}"/></geometry>'
    (tmp_path / "a.urdf").write_text(
        f'<robot name="a"><link name="base_link"><visual>{geometry}</visual></link></robot>'
    )
    result = measured_kbot("check", "a.urdf")
    assert result.status == 1
    assert re.search(rf"{message}.*, more than \d+\. Simplify the mesh", result.out)
    assert result.cpu_s < 3
    assert result.peak_bytes < 400e6


@pytest.mark.parametrize(
    "uri", ["/etc/passwd", "../../../../etc/passwd", "http://127.0.0.1:9/a", "/dev/zero"]
)
def test_buffers_outside_the_package_are_not_read(tmp_path: Path, uri: str) -> None:
    with pytest.raises(KbotError, match=re.escape(uri)):
        load(tmp_path, "gltf", gltf(POINTS, (0, 1, 2), uri))


def test_the_total_size_of_referenced_files_is_limited(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("kbot.model._mesh_files.MOST_NAMED_BYTES", 10 << 10)
    (tmp_path / "big.bin").write_bytes(bytes(1 << 10))
    buffers = [{"byteLength": 1 << 10, "uri": "big.bin"} for _ in range(11)]
    content = json.dumps(description(POINTS, (0, 1, 2), None, buffers=buffers)[0]).encode()
    with pytest.raises(KbotError, match=r"big\.bin"):
        load(tmp_path, "gltf", content)


def png(width: int, height: int, rows: bytes = b"") -> bytes:
    def chunk(name: bytes, body: bytes) -> bytes:
        return struct.pack(">I", len(body)) + name + body + struct.pack(">I", zlib.crc32(name + body))

    head = struct.pack(">IIBBBBB", width, height, 8, 6, 0, 0, 0)
    return (
        b"\x89PNG\r\n\x1a\n"
        + chunk(b"IHDR", head)
        + chunk(b"IDAT", zlib.compress(rows))
        + chunk(b"IEND", b"")
    )


@pytest.mark.filterwarnings("ignore::PIL.Image.DecompressionBombWarning")
@pytest.mark.parametrize(("size", "drawn"), [(9, 9), (2100, MOST_PIXELS), (9000, 0), (50_000, 0)])
def test_textures_are_limited(tmp_path: Path, size: int, drawn: int) -> None:
    """A texture with too many pixels is treated as missing. It is not decoded."""
    rows = (b"\0" + b"\xff" * 4 * size) * size if drawn else b""
    (tmp_path / "a.png").write_bytes(png(size, size, rows))
    (tmp_path / "a.mtl").write_text("newmtl m\nmap_Kd a.png\n")
    content = "mtllib a.mtl\nv 0 0 0\nv 1 0 0\nv 0 1 0\nvt 0 0\nvt 1 0\nvt 0 1\nusemtl m\nf 1/1 2/2 3/3\n"
    (part,) = load(tmp_path, "obj", content.encode()).parts
    assert (part.texture.image.size if part.texture else (0, 0)) == (drawn, drawn)


@pytest.mark.parametrize(
    ("name", "text"),
    [
        ("m.dae", "<COLLADA/>"),
    ],
)
def test_the_error_of_a_damaged_file_has_no_python_message(name: str, text: str, tmp_path: Path) -> None:
    (tmp_path / name).write_text(text)
    with pytest.raises(KbotError) as refused:
        load_mesh(str(tmp_path / name))
    kind = name[2:].upper()
    assert str(refused.value).endswith(f"{name} cannot be read: the file is damaged or not a {kind} file")
