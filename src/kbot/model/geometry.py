"""Shapes a link is made of. Metres; each shape is centred on its own pose, as in URDF."""

from __future__ import annotations

from dataclasses import dataclass

from kbot.text import Origin


@dataclass(frozen=True, slots=True)
class Box:
    """Edge lengths along x, y, z."""

    size: tuple[float, float, float]
    origin: Origin


@dataclass(frozen=True, slots=True)
class Cylinder:
    """Along z."""

    radius: float
    length: float
    origin: Origin


@dataclass(frozen=True, slots=True)
class Sphere:
    radius: float
    origin: Origin


@dataclass(frozen=True, slots=True)
class Capsule:
    """Along z; `length` is that of the cylinder between the half spheres."""

    radius: float
    length: float
    origin: Origin


@dataclass(frozen=True, slots=True)
class Mesh:
    """`uri` as written; `path` is the file it names, None when its package or the file is not found."""

    uri: str
    path: str | None
    scale: tuple[float, float, float]
    origin: Origin


Geometry = Box | Cylinder | Sphere | Capsule | Mesh
