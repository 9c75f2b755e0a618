"""Simple shapes of robots and worlds (box, sphere, cylinder), in metres, centred on their pose."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class Box:
    """Edge lengths along x, y, z."""

    size: tuple[float, float, float]


@dataclass(frozen=True, slots=True)
class Cylinder:
    """Along z."""

    radius: float
    length: float


@dataclass(frozen=True, slots=True)
class Sphere:
    radius: float


@dataclass(frozen=True, slots=True)
class Capsule:
    """Along z; `length` is that of the cylinder between the half spheres."""

    radius: float
    length: float
