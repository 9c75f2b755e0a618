"""A world: bodies of solid shapes with poses, fixed or moving."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from kbot.brief import Brief, counted
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
"""Largest coordinate in m, or angle in rad. Beyond it, the engine's results are meaningless."""
HEAVIEST = 1e12
"""Largest mass in kg, or moment of inertia in kg m^2, of one link."""
GREY: Rgba = (0.72, 0.72, 0.74, 1.0)
IDENTITY = Transform.identity()


@dataclass(frozen=True, slots=True)
class Plane:
    """The infinite plane z = 0 of its pose, solid below. Pictures show `size` (x, y in m) of it."""

    size: tuple[float, float] = (40.0, 40.0)


@dataclass(frozen=True, slots=True)
class Ellipsoid:
    """An ellipsoid with half axes along x, y, z in metres."""

    radii: tuple[float, float, float]


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class TriangleMesh(Brief):
    """Triangles: `vertices` (n, 3) in metres, `faces` (m, 3) indices. It collides as its convex hull.

    A mesh that `is_piece` is a convex piece of another one: its vertices differ, and it has a volume.
    """

    vertices: NDArray[np.float64]
    faces: NDArray[np.int32]
    is_piece: bool = False


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class HeightField(Brief):
    """Heights (rows along y, columns along x) in metres above the pose's z = 0, over `size` (x, y)."""

    heights: NDArray[np.float64]
    size: tuple[float, float]


Shape = Plane | Box | Cylinder | Sphere | Capsule | Ellipsoid | TriangleMesh | HeightField


@dataclass(frozen=True, slots=True, repr=False)
class Part(Brief):
    """One shape of a body, with its pose in the body, its colour and its contact properties.

    Robots drive on `ground` parts. Others are obstacles, which a drive wheel touches with its own shape
    instead of a sphere. `friction` is the sliding coefficient. If two surfaces touch, the smaller coefficient
    applies. A part that is not `solid` does not collide. A part that is not `visible` is not drawn.
    """

    shape: Shape
    pose: Transform = IDENTITY
    rgba: Rgba = GREY
    friction: float = 1.0
    ground: bool = False
    solid: bool = True
    visible: bool = True
    origin: Origin | None = None


@dataclass(frozen=True, slots=True, repr=False)
class Body(Brief):
    """Parts that move together. `mass` is in kg, and None for a static body.

    A body moves freely, or as its `joint` allows. Bodies of one `model` do not collide with each other.
    `weightless` is the share of its weight that gravity does not act on.

    The mass is distributed over the solid parts by volume, unless `inertia` is given (xx, yy, zz, xy, xz, yz
    in kg m^2 about `centre_of_mass`, in the body's axes).
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
        """The name of its model. A body that is not part of a model is its own model."""
        return self.name.partition("::")[0]

    def _shown(self) -> Iterator[str]:
        yield repr(self.name)
        yield counted(len(self.parts), "part")
        yield "static" if self.mass is None else f"{self.mass:g} kg"


@dataclass(frozen=True, slots=True, repr=False)
class World(Brief):
    """A world. Each of its bodies comes after its parent. Gravity is in m/s^2.

    `diagnostics` are the findings from reading it. `origin` is its place in a file, if it is from one.
    """

    name: str
    bodies: tuple[Body, ...]
    gravity: tuple[float, float, float] = (0.0, 0.0, -GRAVITY)
    diagnostics: tuple[Diagnostic, ...] = ()
    loops: tuple[Loop, ...] = ()
    georeference: Georeference | None = None
    origin: Origin | None = None

    def _shown(self) -> Iterator[str]:
        yield repr(self.name)
        yield counted(len(self.bodies), "body", "bodies")
        if self.origin is not None:
            yield repr(self.origin.span.source.path)
