"""Converts shapes of robots and worlds to the engine's geometries."""

from __future__ import annotations

import hashlib

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


def wxyz(pose: Transform) -> tuple[float, float, float, float]:
    """The pose's rotation as the engine writes quaternions."""
    x, y, z, real = pose.quaternion_xyzw
    return real, x, y, z


def add_shape(
    spec: mujoco.MjSpec, body: mujoco.MjsBody, shape: Geometry | w.Shape, pose: Transform
) -> mujoco.MjsGeom:
    """Add a shape to a body at `body_from_shape`; the geometry weighs nothing.

    Raises:
        KbotError: a mesh cannot be read or is flat, or a size is not above zero.
    """
    kind, size = _kind_and_size(shape)
    if not all(0.0 < value < np.inf for value in size):
        raise KbotError(f"a {type(shape).__name__.lower()} needs sizes above zero, not {size}")
    named: dict[str, str] = {}
    match shape:
        case w.Plane():
            size = (0.0, 0.0, 1.0)
        case Mesh():
            named["meshname"] = _mesh_of_file(spec, shape)
        case w.TriangleMesh():
            named["meshname"] = _mesh_of_points(spec, shape)
        case w.HeightField():
            named["hfieldname"] = _add_height_field(spec, shape)
    full = (*size, 0.0, 0.0, 0.0)[:3]
    geom = body.add_geom(type=kind, pos=pose.translation, quat=wxyz(pose), size=full, mass=0.0, **named)
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


def _mesh_of_file(spec: mujoco.MjSpec, mesh: Mesh) -> str:
    if mesh.path is None:
        raise KbotError(f"the mesh {mesh.uri} is not found")
    name = f"{mesh.path} {mesh.scale}"
    if spec.mesh(name) is None:
        _add_mesh(spec, name, load_mesh(mesh.path).vertices * np.array(mesh.scale))
    return name


def _mesh_of_points(spec: mujoco.MjSpec, mesh: w.TriangleMesh) -> str:
    name = mesh_name(mesh.vertices)
    if spec.mesh(name) is None:
        _add_mesh(spec, name, mesh.vertices)
    return name


def mesh_name(*arrays: NDArray[np.float64] | NDArray[np.int_]) -> str:
    """A name that is the same for meshes made of the same numbers, so that the engine has each once."""
    made_of = hashlib.blake2b(digest_size=16)
    for array in arrays:
        made_of.update(array.tobytes())
    return f"mesh {made_of.hexdigest()}"


def _add_mesh(spec: mujoco.MjSpec, name: str, vertices: ArrayLike) -> None:
    """Points whose convex hull is touched."""
    points = np.unique(np.asarray(vertices, dtype=np.float64), axis=0)
    if len(points) < 4 or _is_flat(points):
        raise KbotError("the mesh is flat: it has no inside to touch")
    spec.add_mesh(
        name=name,
        uservert=points.ravel(),
        inertia=mujoco.mjtMeshInertia.mjMESH_INERTIA_CONVEX,
        maxhullvert=_HULL_VERTICES,
    )


def _is_flat(points: NDArray[np.float64]) -> bool:
    spread = np.linalg.svd(points - points.mean(axis=0), compute_uv=False)
    return bool(spread[-1] <= 1e-9 * spread[0])


def _add_height_field(spec: mujoco.MjSpec, field: w.HeightField) -> str:
    heights = np.asarray(field.heights, dtype=np.float64)
    low, high = float(heights.min()), float(heights.max())
    if low < -1e-9:
        raise KbotError("a height field's heights are counted from its own zero: none is below it")
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
