"""A rigid body: what it weighs, what is seen of it, what it touches with."""

from __future__ import annotations

from dataclasses import dataclass

from kbot.model.geometry import Geometry
from kbot.text import Origin

Row = tuple[float, float, float]


@dataclass(frozen=True, slots=True)
class Pose:
    """A URDF `<origin>`: metres, and fixed-axis roll, pitch, yaw in radians, in the parent frame."""

    xyz: tuple[float, float, float] = (0.0, 0.0, 0.0)
    rpy: tuple[float, float, float] = (0.0, 0.0, 0.0)
    origin: Origin | None = None


@dataclass(frozen=True, slots=True)
class Inertial:
    """Mass in kg; tensor in kg m^2 about the centre of mass, in the axes of `pose`."""

    mass: float
    ixx: float
    ixy: float
    ixz: float
    iyy: float
    iyz: float
    izz: float
    pose: Pose
    origin: Origin
    mass_origin: Origin
    inertia_origin: Origin

    @property
    def tensor(self) -> tuple[Row, Row, Row]:
        """The tensor's rows, symmetric."""
        return (
            (self.ixx, self.ixy, self.ixz),
            (self.ixy, self.iyy, self.iyz),
            (self.ixz, self.iyz, self.izz),
        )


@dataclass(frozen=True, slots=True)
class Material:
    """`rgba` in 0..1, None where only a name was given and no such material is defined."""

    name: str
    rgba: tuple[float, float, float, float] | None
    texture: str | None
    origin: Origin


@dataclass(frozen=True, slots=True)
class Visual:
    name: str
    pose: Pose
    geometry: Geometry
    material: Material | None
    origin: Origin


@dataclass(frozen=True, slots=True)
class Collision:
    name: str
    pose: Pose
    geometry: Geometry
    origin: Origin


@dataclass(frozen=True, slots=True)
class Link:
    name: str
    inertial: Inertial | None
    visuals: tuple[Visual, ...]
    collisions: tuple[Collision, ...]
    origin: Origin

    @property
    def shapes(self) -> tuple[Visual | Collision, ...]:
        """What is seen of it, then what it touches with."""
        return (*self.visuals, *self.collisions)
