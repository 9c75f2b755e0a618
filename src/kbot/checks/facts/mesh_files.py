"""Size, triangles and volume of mesh files, cached until the file changes."""

from __future__ import annotations

import os
from dataclasses import dataclass
from functools import lru_cache

from kbot.kinematics.spatial import Vector
from kbot.model.meshes import load_mesh
from kbot.text import KbotError

_MOST_TRIANGLES = 200_000
"""The volume of a mesh with more triangles is not computed."""


@dataclass(frozen=True, slots=True)
class MeshFacts:
    """Bounds in metres before scaling, and the number of triangles."""

    bounds: tuple[Vector, Vector]
    triangles: int


def mesh_facts(path: str) -> MeshFacts | None:
    """The facts of a mesh file. None if it cannot be read; `unreadable` returns the reason."""
    facts = _facts_of(path)
    return facts if isinstance(facts, MeshFacts) else None


def unreadable(path: str) -> str:
    """The reason why a mesh file cannot be read. Empty if it can."""
    facts = _facts_of(path)
    return facts if isinstance(facts, str) else ""


def mesh_volume(path: str) -> float | None:
    """The volume in m^3 of a mesh file before scaling, if the file can be read and the volume is known."""
    facts = mesh_facts(path)
    is_small = facts is not None and facts.triangles <= _MOST_TRIANGLES
    return load_mesh(path).volume if is_small else None


def _facts_of(path: str) -> MeshFacts | str:
    try:
        stat = os.stat(path)
    except OSError as error:
        return f"{path}: {error.strerror}"
    return _read(path, stat.st_mtime_ns, stat.st_size)


@lru_cache(maxsize=1024)
def _read(path: str, _modified: int, _size: int) -> MeshFacts | str:
    try:
        mesh = load_mesh(path)
    except KbotError as error:
        return str(error)
    low, high = (tuple(float(v) for v in m) for m in (mesh.vertices.min(0), mesh.vertices.max(0)))
    return MeshFacts(((low[0], low[1], low[2]), (high[0], high[1], high[2])), len(mesh.faces))
