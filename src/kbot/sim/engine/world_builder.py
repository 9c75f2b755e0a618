"""Builds a world's bodies in the engine's model."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping
from math import pi

import mujoco
import numpy as np

from kbot.kinematics.transform import Transform
from kbot.sim.engine import contacts as touch
from kbot.sim.engine.bounds import check_world
from kbot.sim.engine.geometry import Meshes, add_shape, wxyz
from kbot.sim.engine.placing import MESH_GROUP
from kbot.sim.engine.plane_contacts import add_plane_shapes
from kbot.sim.engine.static_shapes import StaticShapes
from kbot.sim.engine.world_joints import add_world_joint, stiffen
from kbot.text import DiagnosticCollector, KbotError
from kbot.text.progress import working_on
from kbot.world import world as w
from kbot.world.body_joints import Loop

PREFIX = "/"
"""Starts the engine's names of the world's bodies. Those of a robot start with its name and a slash."""


def add_world(
    spec: mujoco.MjSpec, world: w.World, findings: DiagnosticCollector
) -> tuple[mujoco.MjsGeom, ...]:
    """Add a world's bodies and joints to the engine's model, and return the shapes of its ground.

    Shapes that cannot be built go to `findings`.
    """
    check_world(world, findings)
    findings.require()
    spec.option.gravity = world.gravity
    moving_models = {body.model for body in world.bodies if not body.is_static}
    bits = _bits_of_models(world, moving_models)
    added: dict[str, tuple[mujoco.MjsBody, w.Body]] = {}
    meshes, statics, grounds = Meshes(spec), StaticShapes(spec), list[mujoco.MjsGeom]()
    planes = planes_of(world)
    working_on(f"adding {sum(len(body.parts) for body in world.bodies)} shapes to the physics engine")
    for body in world.bodies:
        own = _own_body(spec, body, moving_models, added)
        if own is not None:
            added[body.name] = own, body
        place = body.pose if own is None else Transform.identity()
        geoms = []
        in_body, pose = None, place
        for index, part in enumerate(body.parts):
            if not part.solid:
                continue
            if part.pose is not in_body:  # the pieces of a mesh have the same pose
                in_body, pose = part.pose, place @ part.pose
            geom = _add_part(meshes, own or statics.next_body(), body, part, pose, findings)
            if geom is None:
                continue
            if body.model in bits:
                touch.as_part_of(geom, bits[body.model])
            if own is not None and not body.is_static:
                add_plane_shapes(own, geom, planes)
            name = f"{PREFIX}{body.name}#{index}"
            if own is None:
                statics.name(geom, name)
            else:
                geom.name = name
            if part.ground and body.is_static:
                grounds.append(geom)
            geoms.append((part, geom))
        if body.mass is not None:
            _set_mass(own, body, body.mass, geoms)
    _exclude_within_models(spec, [body for _, body in added.values() if body.model not in bits])
    for loop in world.loops:
        _close(spec, loop, added)
    statics.finish()
    meshes.finish()
    return tuple(grounds)


def planes_of(world: w.World) -> int:
    """The contact bits of a world's planes."""
    planes = 0
    for body in world.bodies:
        for part in body.parts:
            if part.solid and isinstance(part.shape, w.Plane):
                planes |= touch.FLOOR if part.ground else touch.WALL
    return planes


def _own_body(
    spec: mujoco.MjSpec,
    body: w.Body,
    moving_models: set[str],
    added: Mapping[str, tuple[mujoco.MjsBody, w.Body]],
) -> mujoco.MjsBody | None:
    """Add the engine's body for a body of the world. None for a static body.

    Static bodies become shapes of one body, because the engine visits every body in every step. A static body
    of a model with moving bodies keeps its own.
    """
    if body.is_static and (not body.model or body.model not in moving_models):
        return None
    parent, place = spec.worldbody, body.pose
    if body.joint is not None and body.joint.parent in added:
        parent, on = added[body.joint.parent]
        place = on.pose.inverse() @ body.pose
    own = parent.add_body(name=PREFIX + body.name, pos=place.translation, quat=wxyz(place))
    if body.joint is not None:
        add_world_joint(spec, own, body.name, body.joint)
    elif not body.is_static:
        own.add_freejoint(name=PREFIX + body.name)
    own.gravcomp = body.weightless
    return own


def _bits_of_models(world: w.World, moving_models: set[str]) -> dict[str, int]:
    """A contact bit for each of the largest models, so that the bodies of a model do not collide."""
    with_ground = {
        body.model
        for body in world.bodies
        if body.is_static and any(part.ground or isinstance(part.shape, w.Plane) for part in body.parts)
    }
    sizes = Counter(body.model for body in world.bodies if body.model in moving_models - with_ground - {""})
    largest = (model for model, count in sizes.most_common() if count > 1)
    return dict(zip(largest, touch.MODELS, strict=False))


def _exclude_within_models(spec: mujoco.MjSpec, bodies: list[w.Body]) -> None:
    """Disable collisions within models that have no contact bit, as in Gazebo.

    The number of pairs grows with the square of the bodies, so the largest models have bits.
    """
    mates: dict[str, list[w.Body]] = {}
    for body in bodies:
        if body.model and any(part.solid for part in body.parts):
            mates.setdefault(body.model, []).append(body)
    for model in mates.values():
        for index, first in enumerate(model):
            for second in model[index + 1 :]:
                spec.add_exclude(bodyname1=PREFIX + first.name, bodyname2=PREFIX + second.name)


def _close(spec: mujoco.MjSpec, loop: Loop, added: Mapping[str, tuple[mujoco.MjsBody, w.Body]]) -> None:
    """Connect two bodies at each of a loop's points. A body that is not in `added` is the world."""
    poses = {name: body.pose for name, (_, body) in added.items()}
    first, second = (name if name in added else "" for name in (loop.first, loop.second))
    if not first:
        first, second = second, first
    for point in loop.points:
        equality = spec.add_equality(type=mujoco.mjtEq.mjEQ_CONNECT, name1=PREFIX + first)
        equality.objtype = mujoco.mjtObj.mjOBJ_BODY
        equality.name2 = PREFIX + second if second else "world"
        equality.data[:3] = poses[first].inverse().apply(point)
        stiffen(equality)


def owner(model: mujoco.MjModel, geom: int) -> str:
    """The owner of a shape: `/body` of the world, or `robot/link`."""
    name: str = model.geom(geom).name
    if name.startswith(PREFIX):
        return name.rpartition("#")[0]
    return str(model.body(int(model.geom_bodyid[geom])).name)


def _add_part(
    meshes: Meshes,
    added: mujoco.MjsBody,
    body: w.Body,
    part: w.Part,
    pose: Transform,
    findings: DiagnosticCollector,
) -> mujoco.MjsGeom | None:
    if not body.is_static and isinstance(part.shape, w.Plane | w.HeightField):
        why = "a plane or a height field cannot move: make its model static"
        message = f"'{body.name}': this collision shape is ignored: {why}"
        findings.warning("W106", message, part.origin or body.origin, cause=why)
        return None
    try:
        geom = add_shape(meshes, added, part.shape, pose)
    except KbotError as error:
        message = f"'{body.name}': this collision shape is ignored: {error}"
        findings.warning("W106", message, part.origin or body.origin, cause=str(error))
        return None
    touch.set_surface(geom, part.friction)
    if part.ground and body.is_static:
        touch.as_ground(geom)
    else:
        touch.as_obstacle(geom, moving=not body.is_static)
    if body.is_static and isinstance(part.shape, w.TriangleMesh):
        geom.group = MESH_GROUP
    return geom


def _set_mass(
    added: mujoco.MjsBody, body: w.Body, mass: float, geoms: list[tuple[w.Part, mujoco.MjsGeom]]
) -> None:
    if body.inertia is not None:
        added.explicitinertial = True
        added.mass = mass
        added.ipos = body.centre_of_mass or (0.0, 0.0, 0.0)
        added.fullinertia = body.inertia
        return
    volumes = [volume(part.shape) for part, _ in geoms]
    for (_, geom), share in zip(geoms, volumes, strict=True):
        geom.mass = mass * share / sum(volumes)


def volume(shape: w.Shape) -> float:
    """Volume in m^3. 0 for planes and height fields, which are infinite."""
    match shape:
        case w.Box(size=(x, y, z)):
            return x * y * z
        case w.Cylinder(radius=r, length=length):
            return pi * r * r * length
        case w.Sphere(radius=r):
            return 4 / 3 * pi * r**3
        case w.Capsule(radius=r, length=length):
            return pi * r * r * length + 4 / 3 * pi * r**3
        case w.Ellipsoid(radii=(a, b, c)):
            return 4 / 3 * pi * a * b * c
        case w.TriangleMesh(vertices=vertices, faces=faces):
            first, second, third = (vertices[faces[:, i]] for i in range(3))
            return abs(float(np.einsum("ij,ij->", first, np.cross(second, third)))) / 6
    return 0.0


def moving_bodies(model: mujoco.MjModel, world: w.World) -> dict[str, int]:
    """The engine's indices of the bodies that can move, by name."""
    kind = mujoco.mjtObj.mjOBJ_BODY
    return {
        body.name: mujoco.mj_name2id(model, kind, PREFIX + body.name)
        for body in world.bodies
        if not body.is_static
    }


def body_pose(data: mujoco.MjData, body: int) -> Transform:
    """`world_from_body` of a body by the engine's index."""
    w_, x, y, z = data.xquat[body]
    return Transform.from_quaternion_xyzw((x, y, z, w_), data.xpos[body])
