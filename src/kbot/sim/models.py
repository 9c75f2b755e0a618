"""The models of a running world, robots and objects alike: spawn, delete, move and attach them."""

from __future__ import annotations

import dataclasses
import os
import reprlib
from collections.abc import Iterable, Mapping, Sequence
from itertools import count
from typing import NamedTuple

import mujoco
import numpy as np

from kbot.kinematics.planar_pose import PlanarPose
from kbot.kinematics.transform import Transform
from kbot.model import RobotModel
from kbot.model.writer import to_urdf
from kbot.sim.command_delivery import CommandDelivery
from kbot.sim.disturbances import Disturbances
from kbot.sim.engine.assembly import Assembly
from kbot.sim.engine.engine import Engine
from kbot.sim.engine.welds import STANDING, Weld, weld_as_it_stands
from kbot.sim.engine.world_builder import PREFIX, body_pose
from kbot.sim.journal import Journal
from kbot.sim.naming import Naming, is_model_name
from kbot.sim.numbers import FASTEST, FURTHEST, Vector, is_within, vector
from kbot.sim.preparation import prepare, read_robot
from kbot.sim.robot import SimulatedRobot
from kbot.sim.robots import Robots
from kbot.text import Diagnostic, KbotError
from kbot.text.suggest import did_you_mean
from kbot.world.body_joints import Loop
from kbot.world.sdf.reach import Reach
from kbot.world.things import model_of_sdf, thing
from kbot.world.world import Body, HeightField, Plane

SMALLEST, LARGEST = 0.005, 100.0
"""Metres of a box's edge."""

_STILL = (0.0, 0.0, 0.0)
ORIGIN = Transform.identity()


class ModelState(NamedTuple):
    """`world_from_model` (for a robot of its root link), and its speed along the world's axes: m/s, rad/s."""

    pose: Transform
    linear: Vector
    angular: Vector


class _Place(NamedTuple):
    """Where a model is in the engine; `position` and `speed` are below zero for one that cannot move."""

    body: int
    position: int
    speed: int


class Models:
    """The robots and objects of a running world, as Gazebo's services name them."""

    def __init__(
        self,
        engine: Engine,
        robots: Robots,
        commands: CommandDelivery,
        disturbances: Disturbances,
        journal: Journal,
        diagnostics: tuple[Diagnostic, ...],
    ) -> None:
        """`diagnostics`: the warnings that building the world and its first robot gave."""
        self._engine, self._robots, self._commands = engine, robots, commands
        self._disturbances, self._journal = disturbances, journal
        self.built = engine.world
        """The world as it was built, before objects were spawned or deleted."""
        self.diagnostics = diagnostics
        """The warnings that building the world and its robots gave."""

    def use(self, assembly: Assembly) -> None:
        """Replace the engine's model; all that acted in the last one acts in this one."""
        self._engine.use(assembly)
        self._robots.bind()
        self._disturbances.begin_again()

    # robots and objects that come and go

    def spawn_model(
        self,
        robot: RobotModel | str | os.PathLike[str],
        name: str | None = None,
        x: float = 0.0,
        y: float = 0.0,
        yaw: float = 0.0,
        namespace: str | None = None,
        frame_prefix: str | None = None,
    ) -> SimulatedRobot:
        """Put one more robot, or the one of a file, into the running world, on the ground (m, rad).

        Its topics are in its `namespace`, by default its name. `frame_prefix` starts the names of its frames,
        by default the namespace, or at the root its name, and a slash. Everything else goes on.

        Raises:
            DescriptionError: the robot cannot be simulated; every reason with its line.
            KbotError: the name is taken or not a name, the namespace is not one, a number is not finite, or
                the robot would be inside something.
        """
        robot = read_robot(robot)
        name = robot.name if name is None else name
        if not is_model_name(name):
            raise KbotError(
                f"{reprlib.repr(name)} is no robot's name: letters, digits and _ only, a letter first"
            )
        if name in self._robots:
            raise KbotError(f"there is a robot '{name}' already; give this one another name")
        x, y, yaw = vector("a pose", (x, y, yaw), FURTHEST)
        namespace = name if namespace is None else namespace
        frame_prefix = f"{namespace or name}/" if frame_prefix is None else frame_prefix
        naming = Naming(name, namespace, frame_prefix)
        prepared = prepare(robot, naming, PlanarPose(x, y, yaw), None, self._engine.assembly.contacts)
        self.use(self._engine.assembly.with_robot(prepared.plan))
        simulated = self._robots.add(prepared)
        self.diagnostics = (*self.diagnostics, *prepared.findings)
        simulated.restart()
        if simulated.is_following:
            self._commands.follow(simulated)
        numbers = {"namespace": namespace, "frame_prefix": frame_prefix, "description": to_urdf(robot)}
        self._journal.note("spawn_model", robot=name, x=x, y=y, yaw=yaw, **numbers)
        self._robots.report_change()
        return simulated

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
        """Put an object into the running world, its lowest point at x, y, z (m), turned by `yaw` (rad).

        `kind` is an object of kbot.world.things: a model that ships with KBot, or a `box` of a `size` (m).
        Everything else goes on.

        Raises:
            KbotError: there is no such object, the name is taken or not a name, a number is out of range,
                or a robot is in the way.
        """
        if not isinstance(kind, str):
            raise KbotError(f"{reprlib.repr(kind)} is no thing's kind")
        if name is None:
            taken = self._taken()
            name = next(free for n in count(1) if (free := f"{kind}_{n}") not in taken)
        self._require_free(name)
        x, y, z = vector("a place in m", (x, y, z), FURTHEST)
        _, _, yaw = vector("a heading", (0.0, 0.0, yaw), FURTHEST)
        edges = None if size is None else _edges(size)
        body = thing(kind, name, Transform.from_xyz_rpy((x, y, z), (0.0, 0.0, yaw)), edges)
        self._add((body,), (), kind)
        self._journal.note("spawn_thing", kind=kind, name=name, x=x, y=y, z=z, yaw=yaw, size=edges)
        return body

    def spawn_sdf(
        self, sdf: str, name: str | None = None, pose: Transform = ORIGIN, is_confined: bool = False
    ) -> tuple[Body, ...]:
        """Put an SDF model into the running world, from its text or its file.

        `pose` is `world_from_model`, before the model's own pose. The bodies are called `name` for the first
        link and `name::link` for the others. Plugins of the model are ignored. Everything else goes on.

        With `is_confined`, for models that a peer sends, the model may name only files of
        `kbot.world.sdf.reach`, and KBot must be able to use all of its shapes.

        Raises:
            DescriptionError: the model cannot be used; every reason with its line.
            KbotError: the name is taken or not a name, the pose is not one, or a robot is in the way.
        """
        if not isinstance(sdf, str):
            raise KbotError(f"a model of SDF is a text, or the name of a file, not {reprlib.repr(sdf)}")
        if not isinstance(is_confined, bool):
            raise KbotError(f"a model is confined or not, True or False, not {reprlib.repr(is_confined)}")
        _translation(pose)
        bodies, loops = model_of_sdf(sdf, name, pose, Reach() if is_confined else None)
        self._require_free(bodies[0].belongs_to)
        self._add(bodies, loops, bodies[0].belongs_to)
        confined = {"is_confined": True} if is_confined else {}
        self._journal.note("spawn_sdf", sdf=sdf, name=name, matrix=pose.matrix.tolist(), **confined)
        return bodies

    def _taken(self) -> set[str]:
        return {*self._robots, *(body.name for body in self._engine.world.bodies)}

    def _require_free(self, name: object) -> None:
        if not is_model_name(name):
            raise KbotError(
                f"{reprlib.repr(name)} is no thing's name: letters, digits and _ only, a letter first"
            )
        if name in self._taken():
            raise KbotError(f"there is a '{name}' already; give this one another name")

    def _add(self, bodies: tuple[Body, ...], loops: tuple[Loop, ...], what: str) -> None:
        """Raises KbotError: a robot is in the way."""
        old = self._engine.world
        world = dataclasses.replace(old, bodies=(*old.bodies, *bodies), loops=(*old.loops, *loops))
        assembly = self._engine.assembly.with_world(world)
        names = {body.name for body in bodies}
        for plan in assembly.plans.values():
            if assembly.what_it_is_inside(plan) in names:
                raise KbotError(f"no {what} can be put there: '{plan.name}' is in the way")
        self.use(assembly)

    def delete_model(self, name: str) -> None:
        """Remove a robot or an object from the running world, but not the first robot or the ground.

        Raises:
            KbotError: there is no such model, or it cannot be removed.
        """
        if not isinstance(name, str):
            raise KbotError(f"{reprlib.repr(name)} is no model's name")
        if name in self._robots:
            self._robots.remove(name)
            self._disturbances.forget(name)
            self.use(self._engine.assembly.without_robot(name))
            self._robots.report_change()
        else:
            self._delete_thing(name)
        self._journal.note("delete_model", robot=name)

    def _delete_thing(self, name: str) -> None:
        bodies = self._engine.world.bodies
        gone = {body.name for body in bodies if name in (body.name, body.belongs_to)}
        if not gone:
            known = (*self._robots, *(body.name for body in bodies))
            hint = did_you_mean(name, known) or f"there are {', '.join(known)}"
            raise KbotError(f"there is no model {reprlib.repr(name)}: {hint}")
        if any(body.name in gone and _is_ground(body) for body in bodies):
            raise KbotError(f"'{name}' is ground to drive on: it stays")
        if any(b.joint is not None and b.joint.parent in gone and b.name not in gone for b in bodies):
            raise KbotError(f"something hangs on '{name}': it stays")
        loops = tuple(loop for loop in self._engine.world.loops if not gone & {loop.first, loop.second})
        kept = tuple(body for body in bodies if body.name not in gone)
        world = dataclasses.replace(self._engine.world, bodies=kept, loops=loops)
        assembly = self._engine.assembly.with_world(world)
        for body in gone:
            self._disturbances.forget(PREFIX + body)
        self.use(assembly)

    # where they are

    def get_model_state(self, model: str) -> ModelState:
        """Pose and speed of a robot, or of a body of the world that can move.

        Raises:
            KbotError: there is no such model, or it cannot move.
        """
        _, data = self._engine.current()
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
        """Set the pose and speed of a robot's root link, or of a body of the world, in any attitude.

        The speed is along the world's axes (m/s, rad/s). Odometry does not change. What is attached to the
        model is pulled along.

        Raises:
            KbotError: there is no such model, it cannot move, or a number is out of range.
        """
        x, y, z = _translation(pose)
        linear = vector("a speed in m/s", linear, FASTEST)
        angular = vector("a turning speed in rad/s", angular, FASTEST)
        _, position, speed = self._place_of(model)
        if position < 0:
            raise KbotError(f"'{model}' is fixed to the world and cannot be moved")
        if model in self._robots:
            robot = self._robots[model]
            base = pose @ robot.body.base_from_root.inverse()
            robot.stand_at(float(base.translation[0]), float(base.translation[1]), base.yaw, z)
        qx, qy, qz, qw = pose.quaternion_xyzw
        data = self._engine.data
        data.qpos[position : position + 7] = (x, y, z, qw, qx, qy, qz)
        data.qvel[speed : speed + 3] = linear
        data.qvel[speed + 3 : speed + 6] = pose.rotation.T @ np.array(angular)
        self._engine.mark_moved()
        self._journal.note(
            "set_model_state", model=model, matrix=pose.matrix.tolist(), linear=linear, angular=angular
        )

    def set_pose(self, x: float, y: float, yaw: float, robot: str | None = None) -> None:
        """Put a robot at rest on level ground at x, y (m) and yaw (rad). Odometry does not change.

        Raises:
            KbotError: a number is not finite, no such robot, or it is fixed to the world.
        """
        x, y, yaw = vector("a pose", (x, y, yaw), FURTHEST)
        moved = self._robots.named(robot)
        moved.stand_at(x, y, yaw, self._engine.assembly.height(moved.body.root_qpos))
        self._engine.mark_moved()
        self._journal.note("set_pose", robot=moved.name, x=x, y=y, yaw=yaw)

    def set_twist(self, linear: Vector, angular: Vector = (0.0, 0.0, 0.0), robot: str | None = None) -> None:
        """Set the speed of a robot's root link at once, as a kick does: m/s and rad/s along the world's axes.

        Raises:
            KbotError: a number is not finite, no such robot, it is fixed to the world, or the run has
                diverged.
        """
        self._engine.require_sound()
        linear = vector("a speed in m/s", linear, FASTEST)
        angular = vector("a turning speed in rad/s", angular, FASTEST)
        moved = self._robots.named(robot)
        moved.body.set_twist(linear, angular)
        self._engine.mark_moved()
        self._journal.note("set_twist", robot=moved.name, linear=linear, angular=angular)

    def place(self, pose: PlanarPose, joints: Mapping[str, float] | None = None) -> None:
        """After a reset, start the first robot at `pose` of its base, with joints at positions (rad or m).

        The robot is at rest, at its start height. Odometry starts at zero there.

        Raises:
            KbotError: an unknown joint, or a value that is not a number.
        """
        if not isinstance(pose, PlanarPose):
            raise KbotError(f"a place is a PlanarPose(x, y, yaw) in m and rad, not {reprlib.repr(pose)}")
        x, y, yaw = vector("a pose", (pose.x, pose.y, pose.yaw), FURTHEST)
        if not isinstance(joints, Mapping | None):
            raise KbotError(f"joints are positions by name, not {reprlib.repr(joints)}")
        wanted = dict(joints or {})
        robot = self._robots.first
        for joint, position in wanted.items():
            robot.body.dof(joint)
            if not is_within(position, FURTHEST):
                told = f"up to {FURTHEST:g}, not {reprlib.repr(position)}"
                raise KbotError(f"a joint's position is a finite number {told}")
        for joint, position in wanted.items():
            robot.body.set_position(joint, position)
        if robot.body.root_qpos >= 0:
            self.set_pose(x, y, yaw)
        if robot.wheels is not None:
            robot.wheels.restart_odometry()
        self._engine.mark_moved()
        numbers = {joint: float(position) for joint, position in wanted.items()}
        self._journal.note("place", x=x, y=y, yaw=yaw, joints=numbers)

    def body_poses(self) -> dict[str, Transform]:
        """`world_from_body` of the bodies of the world that can move, by name."""
        _, data = self._engine.current()
        return {name: body_pose(data, index) for name, index in self._engine.moving.items()}

    def _place_of(self, model: str) -> _Place:
        if not isinstance(model, str):
            raise KbotError(f"a model is spoken of by its name, not {reprlib.repr(model)}")
        if model in self._robots:
            robot = self._robots[model]
            body, joint = robot.body.index(robot.robot.root), robot.body.prefix
        elif model in self._engine.moving:
            body, joint = self._engine.moving[model], PREFIX + model
        else:
            if any(body.name == model for body in self._engine.world.bodies):
                raise KbotError(f"'{model}' stands still for good")
            known = (*self._robots, *self._engine.moving)
            hint = did_you_mean(model, known) or f"there are {', '.join(known)}"
            raise KbotError(f"there is no model '{model}': {hint}")
        engine = self._engine.model
        index = mujoco.mj_name2id(engine, mujoco.mjtObj.mjOBJ_JOINT, joint)
        if index < 0:
            return _Place(body, -1, -1)
        return _Place(body, int(engine.jnt_qposadr[index]), int(engine.jnt_dofadr[index]))

    # what is attached

    def attach(self, link: str, to: str, robot: str | None = None, to_robot: str | None = None) -> None:
        """Weld a robot's link, at its current pose, to something, as a gripper holds an object.

        `to` is a link of `to_robot`, or without that a body of the world or a link of the first robot. The
        two no longer collide with each other. A reset detaches them; `state` and `restore` keep it.

        Raises:
            KbotError: no such robot, link or body, the two are one, or they are attached already.
        """
        first, second = self._robots.engine_name(link, robot), self._robots.engine_name(to, to_robot)
        if first == second == STANDING:
            raise KbotError(f"'{link}' and '{to}' stand still for good")
        if first == second:
            raise KbotError(f"'{link}' cannot be attached to itself")
        model, data = self._engine.current()
        if model.body(first).weldid == model.body(second).weldid:
            raise KbotError(f"'{link}' and '{to}' are one rigid piece already")
        assembly = self._engine.assembly
        if any({first, second} == {weld.first, weld.second} for weld in assembly.welds):
            raise KbotError(f"'{link}' is attached to '{to}' already")
        weld = weld_as_it_stands(model, data, first, second)
        self.use(assembly.with_welds((*assembly.welds, weld)))
        self._journal.note("attach", link=link, to=to, robot=robot, to_robot=to_robot)

    def detach(self, link: str, robot: str | None = None) -> None:
        """Detach a robot's link, or a body of the world that can move, from everything.

        Raises:
            KbotError: no such robot, link or body, or nothing is attached to it.
        """
        body = self._robots.engine_name(link, robot)
        if body == STANDING:
            raise KbotError(f"'{link}' stands still for good: detach what is attached to it")
        assembly = self._engine.assembly
        kept = tuple(weld for weld in assembly.welds if body not in (weld.first, weld.second))
        if len(kept) == len(assembly.welds):
            raise KbotError(f"'{link}' is attached to nothing")
        self.use(assembly.with_welds(kept))
        self._journal.note("detach", link=link, robot=robot)

    @property
    def attachments(self) -> int:
        """The number of pairs that are attached to each other."""
        return len(self._engine.assembly.welds)

    # what a changed robot takes over

    def continue_from(self, other: Models, start: PlanarPose) -> None:
        """Go on where another simulation is, in one at its start whose first robot is a changed one.

        The other robots, the objects and what is attached come along. A changed robot that would be inside
        something is put at `start`, if it is free there, and nothing stays attached to it.
        """
        self._engine.assembly.let_things_be_as_in(other._engine.assembly)
        self._engine.mark_moved()
        changed = self._robots.first
        first, *others = other._robots.values()
        self._take_over(changed, first, other._engine.assembly)
        has_moved = self._make_room(changed, start)
        for old in others:
            pose, naming = old.ground_truth.pose, old.naming
            robot = self.spawn_model(
                old.robot, old.name, pose.x, pose.y, pose.yaw, naming.namespace, naming.frame_prefix
            )
            self._take_over(robot, old, other._engine.assembly)
        away = {changed.body.prefix + link for link in changed.body.links} if has_moved else set()
        self._attach_again(
            weld for weld in other._engine.assembly.welds if not away & {weld.first, weld.second}
        )

    def _take_over(self, new: SimulatedRobot, old: SimulatedRobot, before: Assembly) -> None:
        """Put a changed robot where it was `before`, its wheels on the same ground, with its commands."""
        positions = old.body.joint_positions
        for joint in new.robot.movable_joints:
            lower, upper = joint.range
            position = positions.get(joint.name)
            if position is not None and joint.name not in new.body.held and lower <= position <= upper:
                new.body.set_position(joint.name, position)
        if new.body.root_qpos >= 0 and old.body.root_qpos >= 0:
            here = self._engine.assembly.height(new.body.root_qpos)
            higher = here - before.height(old.body.root_qpos)
            pose = old.body.link_pose(old.robot.root)
            place = pose.translation + np.array([0.0, 0.0, higher])
            self.set_model_state(new.name, Transform.from_rotation_translation(pose.rotation, place))
        new.take_over(old)

    def _make_room(self, robot: SimulatedRobot, start: PlanarPose) -> bool:
        """Put a robot at `start` if it is inside something now, and not there. Returns whether it was put."""
        assembly = self._engine.assembly
        plan = assembly.plans[robot.name]
        if robot.body.root_qpos < 0 or not assembly.what_it_is_inside(plan):
            return False
        pose = self.get_model_state(robot.name).pose
        self.set_pose(start.x, start.y, start.yaw)
        if not assembly.what_it_is_inside(plan):
            return True
        self.set_model_state(robot.name, pose)
        return False

    def _attach_again(self, welds: Iterable[Weld]) -> None:
        """Attach, at their current poses, what was attached in another world and is in this one."""
        model, data = self._engine.current()
        names = {model.body(i).name: model.body(i).weldid.item() for i in range(model.nbody)}
        kept = tuple(
            weld_as_it_stands(model, data, weld.first, weld.second)
            for weld in welds
            if weld.first in names and weld.second in names and names[weld.first] != names[weld.second]
        )
        if kept:
            self.use(self._engine.assembly.with_welds(kept))


def _is_ground(body: Body) -> bool:
    return any(isinstance(part.shape, Plane | HeightField) for part in body.parts)


def _translation(pose: object) -> Vector:
    if not isinstance(pose, Transform):
        raise KbotError(f"a pose is a Transform, as Transform.from_xyz_rpy makes, not {reprlib.repr(pose)}")
    return vector("a place in m", pose.translation.tolist(), FURTHEST)


def _edges(size: Iterable[object]) -> tuple[float, float, float]:
    edges = vector("the size of a box in m", size, LARGEST)
    if min(edges) < SMALLEST:
        raise KbotError(
            f"the edges of a box are {SMALLEST:g} to {LARGEST:g} m long, not {reprlib.repr(size)}"
        )
    return edges
