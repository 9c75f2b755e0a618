"""The shapes of links with their origins, in metres. Each shape is centred on its pose."""

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
    """A mesh. `uri` is as written. `path` is its file, or None if the package or file is not found."""

    uri: str
    path: str | None
    scale: tuple[float, float, float]
    origin: Origin


Geometry = Box | Cylinder | Sphere | Capsule | Mesh
