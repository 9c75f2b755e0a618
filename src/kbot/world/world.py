"""A world: bodies of solid shapes with poses, fixed or moving."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from kbot.kinematics.spatial import GRAVITY
from kbot.kinematics.transform import Transform
from kbot.model.primitives import Box as Box
from kbot.model.primitives import Capsule as Capsule
from kbot.model.primitives import Cylinder as Cylinder
from kbot.model.primitives import Sphere as Sphere
from kbot.text import Diagnostic, Origin
from kbot.world.body_joints import BodyJoint, Loop
from kbot.world.georeference import Georeference

Rgba = tuple[float, float, float, float]

FURTHEST = 1e6
"""m from a world's origin, or rad; beyond, the engine's numbers mean nothing."""
HEAVIEST = 1e12
"""kg, or kg m^2, of one link."""
GREY: Rgba = (0.72, 0.72, 0.74, 1.0)
IDENTITY = Transform.identity()


@dataclass(frozen=True, slots=True)
class Plane:
    """z = 0 of its pose, solid below; without end. `size` (x, y in m) is what a picture shows of it."""

    size: tuple[float, float] = (40.0, 40.0)


@dataclass(frozen=True, slots=True)
class Ellipsoid:
    """Half axes along x, y, z in metres."""

    radii: tuple[float, float, float]


@dataclass(frozen=True, slots=True, eq=False)
class TriangleMesh:
    """Triangles: `vertices` (n, 3) in metres, `faces` (m, 3) indices. Touched as its convex hull."""

    vertices: NDArray[np.float64]
    faces: NDArray[np.int32]


@dataclass(frozen=True, slots=True, eq=False)
class HeightField:
    """Heights (rows along y, columns along x) in metres above the pose's z = 0, over `size` (x, y)."""

    heights: NDArray[np.float64]
    size: tuple[float, float]


Shape = Plane | Box | Cylinder | Sphere | Capsule | Ellipsoid | TriangleMesh | HeightField


@dataclass(frozen=True, slots=True)
class Part:
    """One shape of a body: where it is in the body, its colour, and how it is touched.

    `ground` parts are driven on, the others run into: a drive wheel meets them differently.
    `friction` is the sliding coefficient; of two surfaces that touch the smaller one counts.
    A part that is not `solid` is only seen, one that is not `visible` only touched.
    """

    shape: Shape
    pose: Transform = IDENTITY
    rgba: Rgba = GREY
    friction: float = 1.0
    ground: bool = False
    solid: bool = True
    visible: bool = True
    origin: Origin | None = None


@dataclass(frozen=True, slots=True)
class Body:
    """Parts that move together. `mass` in kg is None for what stands still.

    A body that moves does so freely, or as its `joint` lets it. Bodies of one `model` do not touch each
    other. `weightless`: the share of its weight that does not pull it down.

    The mass is spread over the solid parts evenly by volume, unless `inertia` (xx, yy, zz, xy, xz,
    yz in kg m^2 about `centre_of_mass` in the body's axes) says otherwise.
    """

    name: str
    parts: tuple[Part, ...]
    pose: Transform = IDENTITY
    mass: float | None = None
    centre_of_mass: tuple[float, float, float] | None = None
    inertia: tuple[float, float, float, float, float, float] | None = None
    origin: Origin | None = None
    joint: BodyJoint | None = None
    model: str = ""
    weightless: float = 0.0

    @property
    def is_static(self) -> bool:
        return self.mass is None

    @property
    def belongs_to(self) -> str:
        """The name of the model that it is a link of; its own where it is one by itself."""
        return self.name.partition("::")[0]


@dataclass(frozen=True, slots=True)
class World:
    """Bodies, those that hang on another after that one, and gravity in m/s^2; a robot starts at the origin.
    `diagnostics` are what was said while it was read."""

    name: str
    bodies: tuple[Body, ...]
    gravity: tuple[float, float, float] = (0.0, 0.0, -GRAVITY)
    diagnostics: tuple[Diagnostic, ...] = ()
    loops: tuple[Loop, ...] = ()
    georeference: Georeference | None = None
