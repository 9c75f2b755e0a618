"""Converts shapes of robots and worlds to the engine's geometries."""

from __future__ import annotations

import hashlib
from functools import cached_property

import mujoco
import numpy as np
from numpy.typing import ArrayLike, NDArray

from kbot.kinematics.transform import Transform
from kbot.model import Geometry, Mesh
from kbot.model.meshes import load_mesh
from kbot.sim.engine.placing import TERRAIN_GROUP
from kbot.text import KbotError
from kbot.world import world as w

_TYPE = mujoco.mjtGeom
_HULL_VERTICES = 64
"""Most vertices of a mesh's convex hull in the engine."""


def wxyz(pose: Transform) -> tuple[float, float, float, float]:
    """The pose's rotation as a quaternion in the engine's order."""
    x, y, z, real = pose.quaternion_xyzw
    return real, x, y, z


def add_shape(
    meshes: Meshes, body: mujoco.MjsBody, shape: Geometry | w.Shape, pose: Transform
) -> mujoco.MjsGeom:
    """Add a shape without mass to a body at `body_from_shape`.

    Raises:
        KbotError: a mesh cannot be read or is flat, or a size is not above 0.
    """
    kind, size = _kind_and_size(shape)
    if not all(0.0 < value < np.inf for value in size):
        raise KbotError(f"the sizes of a {type(shape).__name__.lower()} must be above 0, not {size}")
    named: dict[str, str] = {}
    match shape:
        case w.Plane():
            size = (0.0, 0.0, 1.0)
        case Mesh() | w.TriangleMesh():
            named["meshname"] = meshes.name(shape)
        case w.HeightField():
            named["hfieldname"] = _add_height_field(meshes.spec, shape)
    full = (*size, 0.0, 0.0, 0.0)[:3]
    geom = body.add_geom(
        type=kind, pos=pose.translation.tolist(), quat=wxyz(pose), size=full, mass=0.0, **named
    )
    if kind == _TYPE.mjGEOM_HFIELD:
        geom.group = TERRAIN_GROUP
    return geom


def _kind_and_size(shape: Geometry | w.Shape) -> tuple[mujoco.mjtGeom, tuple[float, ...]]:
    match shape:
        case w.Box(size=(x, y, z)):
            return _TYPE.mjGEOM_BOX, (x / 2, y / 2, z / 2)
        case w.Cylinder(radius=radius, length=length):
            return _TYPE.mjGEOM_CYLINDER, (radius, length / 2)
        case w.Sphere(radius=radius):
            return _TYPE.mjGEOM_SPHERE, (radius,)
        case w.Capsule(radius=radius, length=length):
            return _TYPE.mjGEOM_CAPSULE, (radius, length / 2)
        case w.Ellipsoid(radii=radii):
            return _TYPE.mjGEOM_ELLIPSOID, radii
        case w.Plane():
            return _TYPE.mjGEOM_PLANE, ()
        case w.HeightField():
            return _TYPE.mjGEOM_HFIELD, ()
        case _:
            return _TYPE.mjGEOM_MESH, ()


class Meshes:
    """The meshes of a model. Equal meshes are added once."""

    def __init__(self, spec: mujoco.MjSpec) -> None:
        self.spec = spec
        self._names: dict[Mesh | w.TriangleMesh, str] = {}
        self._new: dict[str, NDArray[np.float64]] = {}

    @cached_property
    def _old(self) -> frozenset[str]:
        """The names of the meshes that the model has. The time of `spec.mesh(name)` grows with their
        number."""
        return frozenset(mesh.name for mesh in self.spec.meshes)

    def name(self, mesh: Mesh | w.TriangleMesh) -> str:
        """Return the name of a mesh, for shapes that use it. `finish` adds it.

        Raises:
            KbotError: the mesh cannot be read, or is flat.
        """
        name = self._names.get(mesh)
        if name is None:
            name = self._names[mesh] = self._wanted(mesh)
        return name

    def finish(self) -> None:
        """Add the meshes to the model, after its shapes: attaching thousands of shapes visits every mesh each
        time."""
        for name, points in self._new.items():
            _add_mesh(self.spec, name, points)
        self._new.clear()

    def _wanted(self, mesh: Mesh | w.TriangleMesh) -> str:
        if isinstance(mesh, w.TriangleMesh):
            name, vertices = mesh_name(mesh.vertices), mesh.vertices
        elif mesh.path is None:
            raise KbotError(f"mesh {mesh.uri} not found")
        else:
            name = f"{mesh.path} {mesh.scale}"
            vertices = load_mesh(mesh.path).vertices * np.array(mesh.scale)
        if name not in self._new and name not in self._old:
            is_piece = isinstance(mesh, w.TriangleMesh) and mesh.is_piece
            self._new[name] = vertices if is_piece else _solid(vertices)
        return name


def mesh_name(*arrays: NDArray[np.float64] | NDArray[np.int_]) -> str:
    """A name that depends only on a mesh's numbers, so that the engine stores equal meshes once."""
    digest = hashlib.blake2b(digest_size=16)
    for array in arrays:
        digest.update(array.tobytes())
    return f"mesh {digest.hexdigest()}"


def _solid(vertices: ArrayLike) -> NDArray[np.float64]:
    """The different vertices of a mesh. Raises KbotError: the mesh is flat."""
    points = distinct(np.asarray(vertices, dtype=np.float64))
    if len(points) < 4 or _is_flat(points):
        raise KbotError("the mesh is flat: a collision shape needs a volume")
    return points


def _add_mesh(spec: mujoco.MjSpec, name: str, points: NDArray[np.float64]) -> None:
    """Add a mesh that collides as the convex hull of its vertices."""
    spec.add_mesh(
        name=name,
        uservert=points.ravel(),
        inertia=mujoco.mjtMeshInertia.mjMESH_INERTIA_CONVEX,
        maxhullvert=_HULL_VERTICES,
    )


def distinct(points: NDArray[np.float64]) -> NDArray[np.float64]:
    """The different rows of an array, in order. Unlike in `numpy.unique`, other threads can run meanwhile."""
    rows = points[np.lexsort(points.T[::-1])]
    is_new = np.ones(len(rows), dtype=bool)
    is_new[1:] = (rows[1:] != rows[:-1]).any(axis=1)
    return rows[is_new]


def _is_flat(points: NDArray[np.float64]) -> bool:
    spread = np.linalg.svd(points - points.mean(axis=0), compute_uv=False)
    return bool(spread[-1] <= 1e-9 * spread[0])


def _add_height_field(spec: mujoco.MjSpec, field: w.HeightField) -> str:
    heights = np.asarray(field.heights, dtype=np.float64)
    low, high = float(heights.min()), float(heights.max())
    if low < -1e-9:
        raise KbotError("the heights of a height field must not be negative")
    rise = max(high, 1e-6)
    name = f"field{len(spec.hfields)}"
    spec.add_hfield(
        name=name,
        nrow=heights.shape[0],
        ncol=heights.shape[1],
        size=(field.size[0] / 2, field.size[1] / 2, rise, 0.1),
        userdata=np.maximum(heights / rise, 0.0).ravel(),
    )
    return name


def own_geometries(model: mujoco.MjModel, robot: str) -> NDArray[np.intp]:
    """The engine's indices of a robot's shapes."""
    prefix = f"{robot}/"
    bodies = np.array([model.body(b).name.startswith(prefix) for b in range(model.nbody)])
    return np.flatnonzero(bodies[model.geom_bodyid])
