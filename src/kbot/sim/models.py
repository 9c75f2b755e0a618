"""Models of a running world, robots and things alike: where they are, and put elsewhere."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping, Sequence
from itertools import count
from typing import Any, NamedTuple

import mujoco
import numpy as np

from kbot.kinematics.odometry import PlanarPose
from kbot.kinematics.transform import Transform
from kbot.sim.engine.world_builder import PREFIX, body_pose
from kbot.sim.naming import is_model_name
from kbot.sim.numbers import FASTEST, FURTHEST, Vector, is_within, shortened, vector
from kbot.sim.population import Population
from kbot.text import KbotError
from kbot.text.suggest import did_you_mean
from kbot.world.joints import Loop
from kbot.world.sdf.reach import Reach
from kbot.world.things import model_of_sdf, thing
from kbot.world.world import Body, HeightField, Plane

SMALLEST, LARGEST = 0.005, 100.0
"""Metres of a box's edge."""

_STILL = (0.0, 0.0, 0.0)
ORIGIN = Transform.identity()


class ModelState(NamedTuple):
    """`world_from_model`, of a robot's root link, and its speed along the world's axes: m/s and rad/s."""

    pose: Transform
    linear: Vector
    angular: Vector


class _Place(NamedTuple):
    """Where a model is in the engine; `position` and `speed` are below zero for one that cannot move."""

    body: int
    position: int
    speed: int


class Models(Population):
    """A running world whose models are moved by hand."""

    def spawn_thing(
        self,
        kind: str,
        name: str | None = None,
        x: float = 0.0,
        y: float = 0.0,
        z: float = 0.0,
        yaw: float = 0.0,
        size: Sequence[float] | None = None,
    ) -> Body:
        """Put a thing of kbot.world.things into the running world, with its foot at a place (m, rad): a model
        that ships with KBot, or a `box` of a size (m). What runs goes on as it was.

        Raises:
            KbotError: there is no such thing, the name is taken or is none, a number is beyond reason, or
                a robot stands there.
        """
        if not isinstance(kind, str):
            raise KbotError(f"{shortened(kind)} is no thing's kind")
        if name is None:
            taken = self._taken()
            name = next(free for n in count(1) if (free := f"{kind}_{n}") not in taken)
        self._require_free(name)
        x, y, z = vector("a place in m", (x, y, z), FURTHEST)
        _, _, yaw = vector("a heading", (0.0, 0.0, yaw), FURTHEST)
        edges = None if size is None else _edges(size)
        body = thing(kind, name, Transform.from_xyz_rpy((x, y, z), (0.0, 0.0, yaw)), edges)
        self._add((body,), (), kind)
        self._note("spawn_thing", kind=kind, name=name, x=x, y=y, z=z, yaw=yaw, size=edges)
        return body

    def spawn_sdf(
        self, sdf: str, name: str | None = None, pose: Transform = ORIGIN, is_confined: bool = False
    ) -> tuple[Body, ...]:
        """Put a model of SDF into the running world: its text, or the name of its file. `pose` is set before
        the model's own, in the world. Its links are `name`, and `name::link` for all but the first; plugins
        in it do nothing. What runs goes on as it was.

        Where it `is_confined`, as what a peer sends is, it names only files of `kbot.world.sdf.reach`, and
        none of its shapes may be left out.

        Raises:
            DescriptionError: the model cannot be used; every reason at its line.
            KbotError: the name is taken or is none, the pose is none, or a robot stands there.
        """
        if not isinstance(sdf, str):
            raise KbotError(f"a model of SDF is a text, or the name of a file, not {shortened(sdf)}")
        if not isinstance(is_confined, bool):
            raise KbotError(f"a model is confined or not, True or False, not {shortened(is_confined)}")
        _translation(pose)
        bodies, loops = model_of_sdf(sdf, name, pose, Reach() if is_confined else None)
        self._require_free(bodies[0].belongs_to)
        self._add(bodies, loops, bodies[0].belongs_to)
        confined = {"is_confined": True} if is_confined else {}
        self._note("spawn_sdf", sdf=sdf, name=name, matrix=pose.matrix.tolist(), **confined)
        return bodies

    def _taken(self) -> set[str]:
        return {*self.robots, *(body.name for body in self.world.bodies)}

    def _require_free(self, name: object) -> None:
        if not is_model_name(name):
            raise KbotError(
                f"{shortened(name)} is no thing's name: letters, digits and _ only, a letter first"
            )
        if name in self._taken():
            raise KbotError(f"there is a '{name}' already; give this one another name")

    def _add(self, bodies: tuple[Body, ...], loops: tuple[Loop, ...], what: str) -> None:
        """Raises KbotError: a robot stands where they would be."""
        old = self.world
        world = dataclasses.replace(old, bodies=(*old.bodies, *bodies), loops=(*old.loops, *loops))
        assembly = self._engine.assembly.with_world(world)
        names = {body.name for body in bodies}
        for plan in assembly.plans.values():
            if assembly.what_it_is_inside(plan) in names:
                raise KbotError(f"no {what} can be put there: '{plan.name}' is in the way")
        self._use(assembly)

    def delete_model(self, name: str) -> None:
        """Take a robot, or a thing, out of the running world; the first robot and the ground stay.

        Raises:
            KbotError: there is no such model, or it has to stay.
        """
        if not isinstance(name, str):
            raise KbotError(f"{shortened(name)} is no model's name")
        if name in self.robots:
            self._delete_robot(name)
        else:
            self._delete_thing(name)
        self._note("delete_model", robot=name)

    def _delete_thing(self, name: str) -> None:
        bodies = self.world.bodies
        gone = {body.name for body in bodies if name in (body.name, body.belongs_to)}
        if not gone:
            known = (*self.robots, *(body.name for body in bodies))
            hint = did_you_mean(name, known) or f"there are {', '.join(known)}"
            raise KbotError(f"there is no model {shortened(name)}: {hint}")
        if any(body.name in gone and _is_ground(body) for body in bodies):
            raise KbotError(f"'{name}' is ground to drive on: it stays")
        if any(b.joint is not None and b.joint.parent in gone and b.name not in gone for b in bodies):
            raise KbotError(f"something hangs on '{name}': it stays")
        loops = tuple(loop for loop in self.world.loops if not gone & {loop.first, loop.second})
        kept = tuple(body for body in bodies if body.name not in gone)
        world = dataclasses.replace(self.world, bodies=kept, loops=loops)
        assembly = self._engine.assembly.with_world(world)
        for body in gone:
            self._disturbances.forget(PREFIX + body)
        self._use(assembly)

    def get_model_state(self, model: str) -> ModelState:
        """Where a robot, or a body of the world that can move, is and how fast.

        Raises:
            KbotError: there is no such model, or it stands still for good.
        """
        _, data = self.engine()
        body, _, speed = self._place_of(model)
        pose = body_pose(data, body)
        if speed < 0:
            return ModelState(pose, _STILL, _STILL)
        x, y, z, *turning = data.qvel[speed : speed + 6].tolist()
        wx, wy, wz = (pose.rotation @ np.array(turning)).tolist()
        return ModelState(pose, (x, y, z), (wx, wy, wz))

    def set_model_state(
        self, model: str, pose: Transform, linear: Vector = _STILL, angular: Vector = _STILL
    ) -> None:
        """Put a robot, by its root link, or a body of the world somewhere else, in any attitude, at a speed
        along the world's axes (m/s, rad/s). Odometry does not learn of it; what is attached is drawn along.

        Raises:
            KbotError: there is no such model, it cannot move, or a number is beyond reason.
        """
        x, y, z = _translation(pose)
        linear = vector("a speed in m/s", linear, FASTEST)
        angular = vector("a turning speed in rad/s", angular, FASTEST)
        _, position, speed = self._place_of(model)
        if position < 0:
            raise KbotError(f"'{model}' is fixed to the world and cannot be moved")
        if model in self.robots:
            robot = self.robots[model]
            base = pose @ robot.base_from_root.inverse()
            robot._stand_at(float(base.translation[0]), float(base.translation[1]), base.yaw, z)
        qx, qy, qz, qw = pose.quaternion_xyzw
        data = self._engine.data
        data.qpos[position : position + 7] = (x, y, z, qw, qx, qy, qz)
        data.qvel[speed : speed + 3] = linear
        data.qvel[speed + 3 : speed + 6] = pose.rotation.T @ np.array(angular)
        self.frames_are_old()
        self._note(
            "set_model_state", model=model, matrix=pose.matrix.tolist(), linear=linear, angular=angular
        )

    def set_pose(self, x: float, y: float, yaw: float, robot: str | None = None) -> None:
        """Put the robot somewhere else, standing still on level ground: metres and radians in the world.
        Its odometry does not learn of it.

        Raises:
            KbotError: a number is not finite, no such robot, or it is fixed to the world.
        """
        x, y, yaw = vector("a pose", (x, y, yaw), FURTHEST)
        moved = self.named(robot)
        moved._stand_at(x, y, yaw, self._engine.assembly.height(moved.root_qpos))
        self.frames_are_old()
        self._note("set_pose", robot=moved.name, x=x, y=y, yaw=yaw)

    def place(self, pose: PlanarPose, joints: Mapping[str, float] | None = None) -> None:
        """After a reset: stand elsewhere, at rest, the base at `pose` in the world at the height it starts
        at, and joints at positions in rad or m. Odometry still starts from zero there.

        Raises:
            KbotError: an unknown joint, or a number that is none.
        """
        if not isinstance(pose, PlanarPose):
            raise KbotError(f"a place is a PlanarPose(x, y, yaw) in m and rad, not {shortened(pose)}")
        x, y, yaw = vector("a pose", (pose.x, pose.y, pose.yaw), FURTHEST)
        if not isinstance(joints, Mapping | None):
            raise KbotError(f"joints are positions by name, not {shortened(joints)}")
        wanted = dict(joints or {})
        for joint, position in wanted.items():
            self._robot.dof(joint)
            if not is_within(position, FURTHEST):
                told = f"up to {FURTHEST:g}, not {shortened(position)}"
                raise KbotError(f"a joint's position is a finite number {told}")
        for joint, position in wanted.items():
            self._robot._set_position(joint, position)
        if self._robot.root_qpos >= 0:
            self.set_pose(x, y, yaw)
        self._robot._restart_odometry()
        self.frames_are_old()
        numbers = {joint: float(position) for joint, position in wanted.items()}
        self._note("place", x=x, y=y, yaw=yaw, joints=numbers)

    def _place_of(self, model: str) -> _Place:
        if not isinstance(model, str):
            raise KbotError(f"a model is spoken of by its name, not {shortened(model)}")
        if model in self.robots:
            robot = self.robots[model]
            body, joint = robot.body(robot.robot.root), robot.prefix
        elif model in self._engine.moving:
            body, joint = self._engine.moving[model], PREFIX + model
        else:
            if any(body.name == model for body in self.world.bodies):
                raise KbotError(f"'{model}' stands still for good")
            known = (*self.robots, *self._engine.moving)
            hint = did_you_mean(model, known) or f"there are {', '.join(known)}"
            raise KbotError(f"there is no model '{model}': {hint}")
        engine = self._engine.model
        index = mujoco.mj_name2id(engine, mujoco.mjtObj.mjOBJ_JOINT, joint)
        if index < 0:
            return _Place(body, -1, -1)
        return _Place(body, int(engine.jnt_qposadr[index]), int(engine.jnt_dofadr[index]))


def _is_ground(body: Body) -> bool:
    return any(isinstance(part.shape, Plane | HeightField) for part in body.parts)


def _translation(pose: object) -> Vector:
    if not isinstance(pose, Transform):
        raise KbotError(f"a pose is a Transform, as Transform.from_xyz_rpy makes, not {shortened(pose)}")
    return vector("a place in m", pose.translation.tolist(), FURTHEST)


def _edges(size: Any) -> tuple[float, float, float]:
    edges = vector("the size of a box in m", size, LARGEST)
    if min(edges) < SMALLEST:
        raise KbotError(f"the edges of a box are {SMALLEST:g} to {LARGEST:g} m long, not {shortened(size)}")
    return edges
