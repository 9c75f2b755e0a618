"""The shapes of links, with their origins. Metres; each shape is centred on its own pose."""

from __future__ import annotations

from dataclasses import dataclass

from kbot.model import primitives
from kbot.text import Origin


@dataclass(frozen=True, slots=True)
class Box(primitives.Box):
    origin: Origin


@dataclass(frozen=True, slots=True)
class Cylinder(primitives.Cylinder):
    origin: Origin


@dataclass(frozen=True, slots=True)
class Sphere(primitives.Sphere):
    origin: Origin


@dataclass(frozen=True, slots=True)
class Capsule(primitives.Capsule):
    origin: Origin


@dataclass(frozen=True, slots=True)
class Mesh:
    """`uri` as written; `path` is the file it names, None when its package or the file is not found."""

    uri: str
    path: str | None
    scale: tuple[float, float, float]
    origin: Origin


Geometry = Box | Cylinder | Sphere | Capsule | Mesh
