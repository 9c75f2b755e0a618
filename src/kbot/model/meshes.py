"""Reads mesh files as triangles, in the same coordinates as ROS."""

from __future__ import annotations

import codecs
from collections.abc import Iterable, Mapping
from contextlib import suppress
from dataclasses import dataclass
from functools import cached_property, lru_cache
from io import BytesIO
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from kbot.model._mesh_limits import MOST_CORNERS, MOST_TEXELS, MeshTooLarge, check_costs
from kbot.model._vertices import distinct_vertices
from kbot.text import KbotError
from kbot.text.files import check_regular

if TYPE_CHECKING:
    import trimesh
    from PIL.Image import Image

FORMATS = ("stl", "obj", "dae", "glb", "gltf", "ply")
MOST_PIXELS = 2048
"""Largest width and height of a texture. Larger ones are scaled down."""
RUN_A_PROGRAM = ("EPS", "WMF")
"""Picture formats for which Pillow runs an external program. They are treated as missing."""
LARGEST = 1e9
"""Largest coordinate in metres. The squares of larger ones do not fit into single precision."""

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Texture:
    """A picture on the surface of a part. `uv` (n, 2) has a position per vertex; (0, 0) is the lower left.

    `format` is that of its file, such as JPEG. Pillow forgets it when an image is copied.
    """

    uv: Array
    image: Image
    format: str | None


@dataclass(frozen=True)
class MeshPart:
    """Triangles of one material: `vertices` (n, 3) in metres, `faces` (m, 3) indices, rgba in 0..1 or None.

    With a `texture`, rgba is its mean colour, for programs that do not draw textures.
    """

    vertices: Array
    faces: NDArray[np.int64]
    rgba: tuple[float, float, float, float] | None
    texture: Texture | None = None


@dataclass(frozen=True, eq=False)
class MeshData:
    """The parts of a mesh file, without scale."""

    parts: tuple[MeshPart, ...]

    @cached_property
    def vertices(self) -> Array:
        """The vertices of all parts, (n, 3)."""
        return np.concatenate([part.vertices for part in self.parts])

    @cached_property
    def faces(self) -> NDArray[np.int64]:
        """The triangles of all parts, (m, 3), as indices into `vertices`."""
        starts = np.cumsum([0] + [len(part.vertices) for part in self.parts[:-1]])
        return np.concatenate([part.faces + at for part, at in zip(self.parts, starts, strict=True)])

    @cached_property
    def volume(self) -> float | None:
        """The enclosed volume in m^3, or None if the surface is not closed or encloses nothing."""
        import trimesh  # imported lazily: slow to import

        kept, group = distinct_vertices(self.vertices)
        mesh = trimesh.Trimesh(self.vertices[kept], group[self.faces], process=False)
        volume = (
            abs(float(mesh.volume)) if mesh.is_watertight else 0.0
        )  # some programs write triangles inside out
        return volume if volume >= 1e-15 else None


def load_mesh(path: str) -> MeshData:
    """Read a mesh file. It stays in memory until the file changes.

    As in rviz and Gazebo, COLLADA's unit is applied, but not its up axis. Other formats are in metres.

    Raises:
        KbotError: the file is missing, damaged, of an unknown format, or has no triangles.
    """
    mesh = read_mesh(path)
    if mesh.data is None:
        raise KbotError(mesh.error)
    return mesh.data


@dataclass(frozen=True, slots=True)
class ReadMesh:
    """A mesh file as it was read: its time in ns and size in bytes, and its data, or the error."""

    path: str
    version: tuple[int, int]
    data: MeshData | None
    error: str = ""


def read_mesh(path: str) -> ReadMesh:
    """Read a mesh file. It stays in memory until the file changes. A missing file has version (0, 0)."""
    try:
        stamp = Path(path).stat()
        check_regular(path, stamp)
    except OSError as error:
        return ReadMesh(path, (0, 0), None, f"the mesh {path} cannot be read: {error.strerror}")
    kept, version = _kept(path), (stamp.st_mtime_ns, stamp.st_size)
    if kept.newest is None or kept.newest.version != version:
        try:
            kept.newest = ReadMesh(path, version, _load(path))
        except KbotError as error:
            kept.newest = ReadMesh(path, version, None, str(error))
    return kept.newest


def keep_mesh(mesh: ReadMesh) -> None:
    """Keep a mesh file that another process has read."""
    _kept(mesh.path).newest = mesh


def kept_version(path: str) -> tuple[int, int]:
    """Return the version of a mesh file that is kept, or (0, 0)."""
    newest = _kept(path).newest
    return (0, 0) if newest is None else newest.version


@dataclass(slots=True)
class _Kept:
    """The newest version of a file. Older ones are dropped, because they may be large."""

    newest: ReadMesh | None = None


@lru_cache(maxsize=256)
def _kept(_path: str) -> _Kept:
    return _Kept()


def _is_binary(path: str) -> bool:
    """Whether the first 4 KiB of a file are not text in UTF-8."""
    with Path(path).open("rb") as file:
        begin = file.read(4096)
    try:
        codecs.getincrementaldecoder("utf-8")().decode(begin)  # the last character may be cut
    except UnicodeDecodeError:
        return True
    return b"\0" in begin


def _load(path: str) -> MeshData:
    import trimesh

    from kbot.model._mesh_files import PackageFiles

    extension = Path(path).suffix.lower().lstrip(".")
    if extension not in FORMATS:
        raise KbotError(f"the mesh {path} has an unknown format. Use one of {', '.join(FORMATS)}")
    try:
        check_costs(path, extension)
        with np.errstate(all="ignore"):  # non-finite numbers are rejected below
            content = _collada(path) if extension == "dae" else path
            scene = trimesh.load_scene(
                content, file_type=extension, process=False, resolver=PackageFiles(path)
            )
            unit = _unit(scene) if extension == "dae" else 1.0
            parts = tuple(_parts(scene, unit))
    except ImportError:  # trimesh tries to import a library that guesses encodings
        raise KbotError(f"the mesh {path} cannot be read: it is not a .{extension} file") from None
    except Exception as error:  # noqa: BLE001 - the loaders raise anything on a broken file
        # other types of error are bugs of the loader, and their text does not help
        is_clear = isinstance(error, ValueError | OSError | IndexError) and str(error)
        text = getattr(error, "strerror", None) or error
        why = text if is_clear else f"the file is damaged or not a {extension.upper()} file"
        raise KbotError(f"the mesh {path} cannot be read: {why}") from None
    if not parts:
        if extension == "stl" and _is_binary(path):  # if a library that guesses encodings is installed
            raise KbotError(f"the mesh {path} cannot be read: it is not a .{extension} file")
        raise KbotError(f"the mesh {path} has no triangles")
    for part in parts:
        _check(path, part)
    return MeshData(parts)


def _collada(path: str) -> dict[str, Any]:
    """The content of a COLLADA file, as arguments of trimesh. Equal corners of triangles are one vertex."""
    from trimesh.exchange.dae import load_collada

    from kbot.model._mesh_files import PackageFiles

    with Path(path).open("rb") as file:
        content: dict[str, Any] = load_collada(file, resolver=PackageFiles(path))
    for mesh in content["geometry"].values():
        visual, colors = mesh["visual"], mesh["vertex_colors"]
        uv = None if visual is None else visual.uv
        kept, group = distinct_vertices(mesh["vertices"], mesh["vertex_normals"], uv)
        mesh["vertices"], mesh["faces"] = mesh["vertices"][kept], group[mesh["faces"]]
        mesh["vertex_colors"] = None if colors is None else colors[kept]
        mesh["vertex_normals"], mesh["process"] = None, False
        if uv is not None:
            visual.uv = uv[kept]
    return content


def _check(path: str, part: MeshPart) -> None:
    """Check a part that a loader returned. Raises KbotError if it is not a valid mesh."""
    size = np.abs(part.vertices).max(initial=0.0)
    if not np.isfinite(size):
        raise KbotError(f"the mesh {path} has a vertex that is not finite")
    if size > LARGEST:
        raise KbotError(f"the mesh {path} has a vertex at {size:g} m, beyond {LARGEST:g} m")
    low, high, count = part.faces.min(), part.faces.max(), len(part.vertices)
    if low < 0 or high >= count:
        index = low if low < 0 else high
        raise KbotError(
            f"the mesh {path} has a triangle with vertex index {index}, but only {count} vertices"
        )


def _unit(scene: trimesh.Scene) -> float:
    """The unit of a COLLADA file in metres. trimesh stores it as text (`0.01 * meters`) for each mesh."""
    for geometry in scene.geometry.values():
        words = str(geometry.metadata.get("units", "meters")).split()
        return float(words[0]) if len(words) > 1 else 1.0
    return 1.0


def _parts(scene: trimesh.Scene, unit: float) -> Iterable[MeshPart]:
    corners = texels = 0
    for node in scene.graph.nodes_geometry:
        matrix, name = scene.graph[node]
        mesh = scene.geometry[name]
        faces = getattr(mesh, "faces", None)
        if faces is None or len(faces) == 0:
            continue
        corners += len(mesh.vertices) + 3 * len(faces)  # a mesh counts each time that it is placed
        if corners > MOST_CORNERS:
            raise MeshTooLarge(
                f"it has more than {MOST_CORNERS} vertices and corners of triangles. Simplify the mesh"
            )
        vertices = np.asarray(mesh.vertices, dtype=np.float64) @ matrix[:3, :3].T + matrix[:3, 3]
        triangles = np.asarray(faces, dtype=np.int64)
        if np.linalg.det(matrix[:3, :3]) < 0.0:
            triangles = triangles[:, ::-1]
        rgba, texture = _color(mesh), None
        if (picture := _picture(mesh, MOST_TEXELS - texels)) is not None:
            texels += picture.image.width * picture.image.height
            uv = np.asarray(mesh.visual.uv, dtype=np.float64)[:, :2]
            rgba, texture = picture.mean, Texture(uv, picture.image, picture.format)
        yield MeshPart(vertices * unit, triangles, rgba, texture)


@dataclass(frozen=True, slots=True)
class _Picture:
    """A decoded picture, the format of its file, and its mean colour."""

    image: Image
    format: str | None
    mean: tuple[float, float, float, float]


def _picture(mesh: Any, texels: int) -> _Picture | None:  # noqa: ANN401 - trimesh has no types
    """The picture of the material, if the file has it and its position on the mesh.

    None if it has more than `texels` pixels, which a file of a few bytes may declare.
    """
    material = getattr(mesh.visual, "material", None)
    image = getattr(material, "baseColorTexture", None) or getattr(material, "image", None)
    uv = getattr(mesh.visual, "uv", None)
    if image is None or uv is None or len(uv) != len(mesh.vertices) or image.width * image.height > texels:
        return None
    if not np.isfinite(uv[:, :2]).all() or image.format in RUN_A_PROGRAM:
        return None
    file = getattr(image, "fp", None)  # of an image that is not decoded yet
    return _decoded_file(file.getvalue()) if isinstance(file, BytesIO) else _decoded(image)


@lru_cache(maxsize=8)
def _decoded_file(content: bytes) -> _Picture:
    """The picture of a file. The meshes of a robot often have the same one."""
    from PIL import Image

    return _decoded(Image.open(BytesIO(content)))


def _decoded(image: Image) -> _Picture:
    kind = image.format
    if max(image.size) > MOST_PIXELS:
        image.thumbnail((MOST_PIXELS, MOST_PIXELS))  # in place: a copy would double the memory
    image.load()
    return _Picture(image, kind, _mean(image))


def _mean(image: Image) -> tuple[float, float, float, float]:
    factor = max(1, min(image.size) // 64)
    if image.mode in ("L", "LA", "RGB", "RGBA"):  # not the numbers of colours in a palette
        image, factor = image.reduce(factor), 1  # first, because converting a large image takes longer
    pixels = np.asarray(image.convert("RGBA").reduce(factor), dtype=np.float64)
    r, g, b, a = (float(c) / 255.0 for c in pixels.reshape(-1, 4).mean(axis=0))
    return r, g, b, a


def _color(mesh: Any) -> tuple[float, float, float, float] | None:  # noqa: ANN401 - trimesh has no types
    """The material's colour, or None if the file has none."""
    visual = mesh.visual
    if not visual.defined:
        return None
    material = getattr(visual, "material", None)
    color = getattr(material, "main_color", None) if material is not None else visual.main_color
    if color is None:
        return None
    r, g, b, a = (float(c) / 255.0 for c in color)
    return r, g, b, a * _opacity(getattr(material, "kwargs", {}))


def _opacity(words: Mapping[str, list[str]]) -> float:
    """The opacity of an OBJ material: `d`, or 1 - `Tr`."""
    with suppress(ValueError, IndexError):
        if "d" in words:
            return min(1.0, max(0.0, float(words["d"][-1])))
        if "tr" in words:
            return min(1.0, max(0.0, 1.0 - float(words["tr"][-1])))
    return 1.0
