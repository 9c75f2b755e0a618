"""Simple shapes of robots and worlds, in metres. Each shape is centred on its pose."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class Box:
    """A box. `size` has the edge lengths along x, y and z."""

    size: tuple[float, float, float]


@dataclass(frozen=True, slots=True)
class Cylinder:
    """A cylinder along z."""

    radius: float
    length: float


@dataclass(frozen=True, slots=True)
class Sphere:
    radius: float


@dataclass(frozen=True, slots=True)
class Capsule:
    """A capsule along z. `length` is that of the cylinder between the half spheres."""

    radius: float
    length: float
