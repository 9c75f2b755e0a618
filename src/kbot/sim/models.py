"""Spawns, deletes, moves and attaches the models of a running world: robots and objects."""

from __future__ import annotations

import dataclasses
import os
import reprlib
from collections.abc import Iterable, Iterator, Mapping, Sequence
from itertools import count
from typing import NamedTuple

import mujoco
import numpy as np

from kbot.brief import Brief, counted
from kbot.kinematics.planar_pose import PlanarPose
from kbot.kinematics.transform import Transform
from kbot.model import RobotModel
from kbot.model.writer import to_urdf
from kbot.sim.command_delivery import CommandDelivery
from kbot.sim.disturbances import Disturbances
from kbot.sim.engine.assembly import Assembly
from kbot.sim.engine.engine import Engine
from kbot.sim.engine.welds import STATIC, Weld, weld_at_current_pose
from kbot.sim.engine.world_builder import PREFIX, body_pose
from kbot.sim.journal import Journal
from kbot.sim.naming import Naming, is_model_name
from kbot.sim.numbers import FASTEST, FURTHEST, Vector, is_within, vector
from kbot.sim.preparation import prepare, read_robot
from kbot.sim.robot import SimulatedRobot
from kbot.sim.robots import Robots
from kbot.sim.start_findings import without_ground
from kbot.text import Diagnostic, KbotError
from kbot.text.suggest import did_you_mean
from kbot.world.body_joints import Loop
from kbot.world.things import SdfModel, read_sdf_model, thing
from kbot.world.world import Body, HeightField, Plane

SMALLEST, LARGEST = 0.005, 100.0
"""Smallest and largest edge of a spawned box, in m."""

_STILL = (0.0, 0.0, 0.0)
ORIGIN = Transform.identity()


class ModelState(NamedTuple):
    """`world_from_model` (a robot's is that of its root link), and its velocity in world axes: m/s, rad/s."""

    pose: Transform
    linear: Vector
    angular: Vector


class _Place(NamedTuple):
    """A model's indices in the engine. `position` and `speed` are -1 for a model that cannot move."""

    body: int
    position: int
    speed: int


class Models(Brief):
    """The robots and objects of a running world. Its methods are named after Gazebo's services."""

    def __init__(
        self,
        engine: Engine,
        robots: Robots,
        commands: CommandDelivery,
        disturbances: Disturbances,
        journal: Journal,
        diagnostics: tuple[Diagnostic, ...],
    ) -> None:
        """`diagnostics` are the warnings from building the world and its first robot."""
        self._engine, self._robots, self._commands = engine, robots, commands
        self._disturbances, self._journal = disturbances, journal
        self.built = engine.world
        """The world before objects were spawned or deleted."""
        self.diagnostics = diagnostics
        """The warnings from building the world, its robots and its models."""

    def use(self, assembly: Assembly) -> None:
        """Replace the engine's model. Commands, pushes and faults continue in the new one."""
        self._engine.use(assembly)
        self._robots.bind()
        self._disturbances.reapply()

    # spawn and delete

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
        """Add a robot, or the robot of a file, to the running world, on the ground (m, rad).

        Its topics are in its `namespace`, by default its name. `frame_prefix` starts the names of its frames.
        It defaults to the namespace and a slash, or to the name and a slash if the namespace is empty.

        Raises:
            DescriptionError: the robot cannot be simulated. It carries every reason with its line.
            KbotError: the name is taken or not valid, the namespace is not valid, a number is not finite, the
                robot would overlap something, or one of its topics exists with another type. The robot is
                then not added.
        """
        robot = read_robot(robot)
        name = robot.name if name is None else name
        if not is_model_name(name):
            raise KbotError(
                f"{reprlib.repr(name)} is not a valid robot name: use letters, digits and _, and begin with"
                " a letter"
            )
        if name in self._robots:
            raise KbotError(f"the robot name '{name}' is taken: choose another name")
        x, y, yaw = vector("a pose", (x, y, yaw), FURTHEST)
        namespace = name if namespace is None else namespace
        frame_prefix = f"{namespace or name}/" if frame_prefix is None else frame_prefix
        naming = Naming(name, namespace, frame_prefix)
        prepared = prepare(robot, naming, PlanarPose(x, y, yaw), None, self._engine.assembly.contacts)
        before = self._engine.assembly
        self.use(before.with_robot(prepared.plan))
        try:
            simulated = self._robots.add(prepared)
        except KbotError:
            self.use(before)
            raise
        off_ground = without_ground(self._engine.world, name, prepared, self._engine.assembly)
        self.diagnostics = (*self.diagnostics, *prepared.findings, *filter(None, [off_ground]))
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
        """Add an object to the running world, its lowest point at x, y, z (m), turned by `yaw` (rad).

        `kind` is a model that ships with KBot, or `box` with a `size` (m): see kbot.world.things.

        Raises:
            KbotError: the object does not exist, the name is taken or not valid, a number is out of range,
                or a robot is in the way.
        """
        if not isinstance(kind, str):
            raise KbotError(f"the kind of an object must be a string, not {reprlib.repr(kind)}")
        if name is None:
            taken = self._taken()
            name = next(free for n in count(1) if (free := f"{kind}_{n}") not in taken)
        self._require_free(name)
        x, y, z = vector("a position in m", (x, y, z), FURTHEST)
        _, _, yaw = vector("a heading", (0.0, 0.0, yaw), FURTHEST)
        edges = None if size is None else _edges(size)
        body = thing(kind, name, Transform.from_xyz_rpy((x, y, z), (0.0, 0.0, yaw)), edges)
        self._add((body,), (), kind)
        self._journal.note("spawn_thing", kind=kind, name=name, x=x, y=y, z=z, yaw=yaw, size=edges)
        return body

    def spawn_sdf(
        self,
        sdf: str | SdfModel,
        name: str | None = None,
        pose: Transform = ORIGIN,
        is_confined: bool = False,
    ) -> tuple[Body, ...]:
        """Add an SDF model to the running world: one that was read, or from its text or its file.

        `pose` is `world_from_model`. The model's own `<pose>` is applied after it. The first link's body is
        called `name`, the others `name::link`. Plugins of the model are ignored.

        Use `is_confined` for models that a peer sends. Then the model may name only the files that
        `kbot.world.sdf.reach` allows, and KBot must be able to use all of its shapes.

        Raises:
            DescriptionError: the model cannot be used. It carries every reason with its line.
            KbotError: the name is taken or not valid, the pose is not valid, or a robot is in the way.
        """
        if not isinstance(sdf, str | SdfModel):
            raise KbotError(f"an SDF model must be its text or the name of a file, not {reprlib.repr(sdf)}")
        if not isinstance(is_confined, bool):
            raise KbotError(f"is_confined must be True or False, not {reprlib.repr(is_confined)}")
        _translation(pose)
        model = read_sdf_model(sdf, name, is_confined=is_confined) if isinstance(sdf, str) else sdf
        bodies, loops = model.placed(name, pose)
        self._require_free(bodies[0].belongs_to)
        self._add(bodies, loops, bodies[0].belongs_to)
        self.diagnostics = (*self.diagnostics, *model.diagnostics)
        confined = {"is_confined": True} if model.is_confined else {}
        self._journal.note("spawn_sdf", sdf=model.sdf, name=name, matrix=pose.matrix.tolist(), **confined)
        return bodies

    def _taken(self) -> set[str]:
        return {*self._robots, *(body.name for body in self._engine.world.bodies)}

    def _require_free(self, name: object) -> None:
        if not is_model_name(name):
            raise KbotError(
                f"{reprlib.repr(name)} is not a valid object name: use letters, digits and _, and begin with"
                " a letter"
            )
        if name in self._taken():
            raise KbotError(f"the name '{name}' is taken: choose another name")

    def _add(self, bodies: tuple[Body, ...], loops: tuple[Loop, ...], what: str) -> None:
        """Add bodies to the world. Raises KbotError: a robot is in the way."""
        old = self._engine.world
        world = dataclasses.replace(old, bodies=(*old.bodies, *bodies), loops=(*old.loops, *loops))
        assembly = self._engine.assembly.with_world(world)
        names = {body.name for body in bodies}
        for plan in assembly.plans.values():
            if assembly.overlapped_by(plan) in names:
                raise KbotError(f"'{what}' cannot be placed there: robot '{plan.name}' is in the way")
        self.use(assembly)

    def delete_model(self, name: str) -> None:
        """Remove a robot or an object from the running world. The first robot and the ground stay.

        Raises:
            KbotError: the model does not exist or cannot be removed.
        """
        if not isinstance(name, str):
            raise KbotError(f"the name of a model must be a string, not {reprlib.repr(name)}")
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
        deleted = {body.name for body in bodies if name in (body.name, body.belongs_to)}
        if not deleted:
            known = (*self._robots, *(body.name for body in bodies))
            hint = did_you_mean(name, known) or f"choose from {', '.join(known)}"
            raise KbotError(f"unknown model {reprlib.repr(name)}: {hint}")
        if any(body.name in deleted and _is_ground(body) for body in bodies):
            raise KbotError(f"'{name}' is ground and cannot be deleted")
        for other in bodies:
            if other.joint is not None and other.joint.parent in deleted and other.name not in deleted:
                raise KbotError(f"'{name}' cannot be deleted: a joint connects '{other.name}' to it")
        loops = tuple(loop for loop in self._engine.world.loops if not deleted & {loop.first, loop.second})
        kept = tuple(body for body in bodies if body.name not in deleted)
        world = dataclasses.replace(self._engine.world, bodies=kept, loops=loops)
        assembly = self._engine.assembly.with_world(world)
        for body in deleted:
            self._disturbances.forget(PREFIX + body)
        self.use(assembly)

    # poses and velocities

    def get_model_state(self, model: str) -> ModelState:
        """Pose and velocity of a robot, or of a body of the world that can move.

        Raises:
            KbotError: the model does not exist or cannot move.
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
        """Set the pose and velocity of a robot's root link, or of a body of the world, in any attitude.

        The velocity is in world axes (m/s, rad/s). Odometry does not change. The constraint of an attachment
        pulls attached models along.

        Raises:
            KbotError: the model does not exist or cannot move, or a number is out of range.
        """
        x, y, z = _translation(pose)
        linear = vector("the linear velocity in m/s", linear, FASTEST)
        angular = vector("the angular velocity in rad/s", angular, FASTEST)
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
        """Place a robot at rest on level ground at x, y (m) and yaw (rad). Odometry does not change.

        Raises:
            KbotError: a number is not finite, or the robot does not exist or is fixed to the world.
        """
        x, y, yaw = vector("a pose", (x, y, yaw), FURTHEST)
        moved = self._robots.named(robot)
        moved.stand_at(x, y, yaw, self._engine.assembly.height(moved.body.root_qpos))
        self._engine.mark_moved()
        self._journal.note("set_pose", robot=moved.name, x=x, y=y, yaw=yaw)

    def set_twist(self, linear: Vector, angular: Vector = (0.0, 0.0, 0.0), robot: str | None = None) -> None:
        """Set the velocity of a robot's root link at once, as a kick does: m/s and rad/s in world axes.

        Raises:
            KbotError: a number is not finite, the robot does not exist or is fixed to the world, or the run
                has diverged.
        """
        self._engine.require_sound()
        linear = vector("the linear velocity in m/s", linear, FASTEST)
        angular = vector("the angular velocity in rad/s", angular, FASTEST)
        moved = self._robots.named(robot)
        moved.body.set_twist(linear, angular)
        self._engine.mark_moved()
        self._journal.note("set_twist", robot=moved.name, linear=linear, angular=angular)

    def place(self, pose: PlanarPose, joints: Mapping[str, float] | None = None) -> None:
        """After a reset, start the first robot with its base at `pose` and joints at positions (rad or m).

        The robot is at rest, at its start height. Odometry restarts at zero there.

        Raises:
            KbotError: a joint is unknown, or a value is not a number.
        """
        if not isinstance(pose, PlanarPose):
            raise KbotError(f"a pose must be a PlanarPose(x, y, yaw) in m and rad, not {reprlib.repr(pose)}")
        x, y, yaw = vector("a pose", (pose.x, pose.y, pose.yaw), FURTHEST)
        if not isinstance(joints, Mapping | None):
            raise KbotError(f"joints must map joint names to positions, not {reprlib.repr(joints)}")
        wanted = dict(joints or {})
        robot = self._robots.first
        for joint, position in wanted.items():
            robot.body.dof(joint)
            if not is_within(position, FURTHEST):
                allowed = f"a finite number up to {FURTHEST:g}, not {reprlib.repr(position)}"
                raise KbotError(f"the position of joint '{joint}' must be {allowed}")
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
            raise KbotError(f"the name of a model must be a string, not {reprlib.repr(model)}")
        if model in self._robots:
            robot = self._robots[model]
            body, joint = robot.body.index(robot.robot.root), robot.body.prefix
        elif model in self._engine.moving:
            body, joint = self._engine.moving[model], PREFIX + model
        else:
            if any(body.name == model for body in self._engine.world.bodies):
                raise KbotError(f"'{model}' is static and cannot be moved")
            known = (*self._robots, *self._engine.moving)
            hint = did_you_mean(model, known) or f"choose from {', '.join(known)}"
            raise KbotError(f"unknown model '{model}': {hint}")
        engine = self._engine.model
        index = mujoco.mj_name2id(engine, mujoco.mjtObj.mjOBJ_JOINT, joint)
        if index < 0:
            return _Place(body, -1, -1)
        return _Place(body, int(engine.jnt_qposadr[index]), int(engine.jnt_dofadr[index]))

    # attachments

    def attach(self, link: str, to: str, robot: str | None = None, to_robot: str | None = None) -> None:
        """Weld a robot's link, at its current pose, to another body, as a gripper holds an object.

        `to` is a link of `to_robot`. Without `to_robot`, it is a body of the world or a link of the first
        robot. The two bodies no longer collide with each other. A reset detaches them. `state` and `restore`
        keep the attachment.

        Raises:
            KbotError: the robot, link or body does not exist, or the two bodies are the same or are attached
                already.
        """
        first, second = self._robots.engine_name(link, robot), self._robots.engine_name(to, to_robot)
        if first == second == STATIC:
            raise KbotError(f"'{link}' and '{to}' are both static and cannot be attached")
        if first == second:
            raise KbotError(f"'{link}' cannot be attached to itself")
        model, data = self._engine.current()
        if model.body(first).weldid == model.body(second).weldid:
            raise KbotError(f"'{link}' and '{to}' are rigidly connected already")
        assembly = self._engine.assembly
        if any({first, second} == {weld.first, weld.second} for weld in assembly.welds):
            raise KbotError(f"'{link}' is attached to '{to}' already")
        weld = weld_at_current_pose(model, data, first, second)
        self.use(assembly.with_welds((*assembly.welds, weld)))
        self._journal.note("attach", link=link, to=to, robot=robot, to_robot=to_robot)

    def detach(self, link: str, robot: str | None = None) -> None:
        """Detach a robot's link, or a body of the world that can move, from everything.

        Raises:
            KbotError: the robot, link or body does not exist, or nothing is attached to it.
        """
        body = self._robots.engine_name(link, robot)
        if body == STATIC:
            raise KbotError(f"'{link}' is static: detach the body that is attached to it instead")
        assembly = self._engine.assembly
        kept = tuple(weld for weld in assembly.welds if body not in (weld.first, weld.second))
        if len(kept) == len(assembly.welds):
            raise KbotError(f"'{link}' is not attached to anything")
        self.use(assembly.with_welds(kept))
        self._journal.note("detach", link=link, robot=robot)

    @property
    def attachments(self) -> int:
        """The number of attached pairs."""
        return len(self._engine.assembly.welds)

    # a changed robot

    def continue_from(self, other: Models, start: PlanarPose) -> None:
        """Take over the state of another simulation. This one is new, and its first robot was changed.

        The other robots, the objects and the attachments are taken over too. A changed robot that would
        overlap something is moved to `start`, if that is free, and is detached from everything.
        """
        self._engine.assembly.copy_bodies_from(other._engine.assembly)
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
        detached = {changed.body.prefix + link for link in changed.body.links} if has_moved else set()
        self._attach_again(
            weld for weld in other._engine.assembly.welds if not detached & {weld.first, weld.second}
        )

    def _take_over(self, new: SimulatedRobot, old: SimulatedRobot, before: Assembly) -> None:
        """Give a changed robot its pose, joints and commands `before`, with its wheels on the same ground."""
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
        """Move a robot to `start` if it overlaps something now and would not there.

        Returns whether it was moved.
        """
        assembly = self._engine.assembly
        plan = assembly.plans[robot.name]
        if robot.body.root_qpos < 0 or not assembly.overlapped_by(plan):
            return False
        pose = self.get_model_state(robot.name).pose
        self.set_pose(start.x, start.y, start.yaw)
        if not assembly.overlapped_by(plan):
            return True
        self.set_model_state(robot.name, pose)
        return False

    def _attach_again(self, welds: Iterable[Weld]) -> None:
        """Restore another world's attachments between bodies that exist here, at their current poses."""
        model, data = self._engine.current()
        names = {model.body(i).name: model.body(i).weldid.item() for i in range(model.nbody)}
        kept = tuple(
            weld_at_current_pose(model, data, weld.first, weld.second)
            for weld in welds
            if weld.first in names and weld.second in names and names[weld.first] != names[weld.second]
        )
        if kept:
            self.use(self._engine.assembly.with_welds(kept))

    def _shown(self) -> Iterator[str]:
        yield from map(repr, self._robots)
        yield counted(len(self._engine.world.bodies), "body", "bodies")


def _is_ground(body: Body) -> bool:
    return any(isinstance(part.shape, Plane | HeightField) for part in body.parts)


def _translation(pose: object) -> Vector:
    if not isinstance(pose, Transform):
        raise KbotError(
            f"a pose must be a Transform, for example Transform.from_xyz_rpy(...), not {reprlib.repr(pose)}"
        )
    return vector("a position in m", pose.translation.tolist(), FURTHEST)


def _edges(size: Iterable[object]) -> tuple[float, float, float]:
    edges = vector("the size of a box in m", size, LARGEST)
    if min(edges) < SMALLEST:
        raise KbotError(
            f"the edges of a box must be {SMALLEST:g} to {LARGEST:g} m long, not {reprlib.repr(size)}"
        )
    return edges
