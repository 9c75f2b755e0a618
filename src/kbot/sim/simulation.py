"""A robot in a world, in simulated time: step it, drive it, read where it is."""

from __future__ import annotations

import os
import re
from collections.abc import Mapping
from typing import Protocol, TypeVar

import mujoco
import numpy as np
from numpy.typing import NDArray

from kbot.kinematics.differential_drive import DifferentialDrive, NoDrive
from kbot.kinematics.odometry import PlanarPose, PlanarTwist
from kbot.kinematics.transform import Transform
from kbot.messages.types import JointState
from kbot.model import Robot
from kbot.model.load import load_robot
from kbot.sim import recipe
from kbot.sim.disturbed import Disturbed
from kbot.sim.drive import DriveLimits
from kbot.sim.joints import limits
from kbot.sim.motion import Motion
from kbot.sim.numbers import is_finite
from kbot.sim.recipe import Contacts
from kbot.sim.robot import SimulatedRobot
from kbot.sim.state import State, copy_engine, digest, read_engine, restore_engine
from kbot.sim.world_builder import body_pose
from kbot.text import KbotError
from kbot.text.suggest import did_you_mean
from kbot.world import World, load_world

_NAME = re.compile(r"[A-Za-z]\w*")
ORIGIN = PlanarPose()
S = TypeVar("S")
S_co = TypeVar("S_co", covariant=True)


class Mountable(Protocol[S_co]):
    """What can be mounted on a simulated robot."""

    def mount(self, simulation: Simulation) -> S_co: ...


class Simulation(Disturbed):
    """A robot in a world, and others that may join it.

    Time passes only in `step` and `run`; the same robot, world, seed and commands give the same bytes.
    The world's frame is that of the odometry at the start: x ahead, y left, z up, in metres.
    `diagnostics` are the warnings that building it gave.
    """

    def __init__(
        self,
        robot: Robot | str | os.PathLike[str],
        world: str | World = "empty",
        seed: int = 0,
        timestep: float = recipe.TIMESTEP,
        contacts: str | Contacts = Contacts.RECIPE,
        limits: DriveLimits | None = None,
        start: PlanarPose = ORIGIN,
    ) -> None:
        """`robot` may be the file of one (`kbot` is the one that ships); `timestep` in seconds; `contacts`
        is `recipe` or `as-written`; `limits` stand in for those that the robot's own plugin or controller
        gives.

        Raises:
            DescriptionError: the robot cannot be simulated; every reason at its line.
            KbotError: no such world, a step or a seed that is none.
        """
        super().__init__(_robot(robot), load_world(world), seed, timestep, _contacts(contacts), limits, start)
        self.reset()

    def reset(self) -> None:
        """Back to the start: the same robot and world at time 0, without commands."""
        mujoco.mj_resetData(self._model, self._data)
        self._pushes.clear()
        for robot in self.robots.values():
            self._put_joints(robot)
            robot.reset()
        self.random = np.random.default_rng(self.seed)
        self._start_at(0)
        self._note("reset")

    def place(self, pose: PlanarPose, joints: Mapping[str, float] | None = None) -> None:
        """After a reset: stand elsewhere, at rest, the base at `pose` in the world at the height it starts
        at, and joints at positions in rad or m. Odometry still starts from zero there.

        Raises:
            KbotError: an unknown joint.
        """
        for joint, position in (joints or {}).items():
            self._robot.set_position(joint, position)
        if self._robot.root_qpos >= 0:
            self.set_pose(pose.x, pose.y, pose.yaw)
        self._robot.restart_odometry()
        self._fresh = -1
        self._note("place", x=pose.x, y=pose.y, yaw=pose.yaw, joints=dict(joints or {}))

    def with_robot(self, robot: Robot) -> Simulation:
        """A simulation of a changed robot that goes on where this one stands: its time, pose, joint
        positions, odometry and command, and the other robots with theirs.

        Raises:
            DescriptionError: the changed robot cannot be simulated; this one is left as it is.
        """
        other = Simulation(
            robot, self.world, self.seed, self.timestep, self.contacts, self._limits, self.start
        )
        _put_as(other._robot, self._robot, other)
        for old in list(self.robots.values())[1:]:
            pose = old.ground_truth.pose
            _put_as(other.spawn(old.robot, old.name, pose.x, pose.y, pose.yaw), old, other)
        other._start_at(self._steps)
        return other

    # commands

    def cmd_vel(self, linear: float, angular: float) -> None:
        """Drive forward at `linear` m/s while turning at `angular` rad/s, until told otherwise.

        Raises:
            KbotError: the robot cannot drive (the reason is said), or a number is not finite.
        """
        self.take_command(self._robot, linear, angular, None)

    def command(self, linear: float, angular: float, watchdog: float | None = None) -> None:
        """As `cmd_vel`, but taken for lost, and the robot stopped, `watchdog` seconds of simulated time
        after the last one (half a second, unless the robot's controller says otherwise): for commands
        that come from outside, by topic or page."""
        self._robot.command(linear, angular, watchdog)

    def set_joint(self, joint: str, position: float) -> None:
        """Hold a joint that does not drive at a position (rad or m) by a servo, within its effort limit.

        Raises:
            KbotError: no such joint, one that drives or follows another, or a number that is not finite.
        """
        self._robot.hold(joint, position)
        self._note("hold", joint=joint, position=position)

    def release_joint(self, joint: str) -> None:
        """Let a held joint move freely again. Raises KbotError for an unknown joint."""
        self._robot.release(joint)
        self._note("release", joint=joint)

    def set_pose(self, x: float, y: float, yaw: float, robot: str | None = None) -> None:
        """Put the robot somewhere else, standing still on level ground: metres and radians in the world.
        Its odometry does not learn of it.

        Raises:
            KbotError: a number is not finite, no such robot, or it is fixed to the world.
        """
        if not all(is_finite(value) for value in (x, y, yaw)):
            raise KbotError(f"a pose is three finite numbers, not {x!r}, {y!r}, {yaw!r}")
        moved = self.named(robot)
        moved.stand_at(x, y, yaw, self._assembly.height(moved.root_qpos))
        self._fresh = -1
        self._note("set_pose", robot=moved.name, x=x, y=y, yaw=yaw)

    # what can be read

    @property
    def robot(self) -> Robot:
        return self._robot.robot

    @property
    def drive(self) -> DifferentialDrive | NoDrive:
        """How the robot drives, or why it cannot."""
        return self._robot.drive

    @property
    def twist(self) -> PlanarTwist:
        """The commanded twist as it is slewed now."""
        linear, angular = self._robot.controller.twist if self._robot.can_drive else (0.0, 0.0)
        return PlanarTwist(linear, 0.0, angular)

    @property
    def odometry(self) -> Motion:
        """What the wheels tell: `pose` of the base in the odometry frame, `twist` in its own."""
        return self._robot.odometry

    @property
    def ground_truth(self) -> Motion:
        """Where the base truly is in the world, and its twist in its own frame."""
        return self._robot.ground_truth

    @property
    def joint_positions(self) -> dict[str, float]:
        """rad or m, by joint."""
        return self._robot.joint_positions

    @property
    def joint_velocities(self) -> dict[str, float]:
        """rad/s or m/s, by joint."""
        return self._robot.joint_velocities

    @property
    def joint_states(self) -> JointState:
        """The message of the topic `joint_states` as of now."""
        return self._topics[self._robot.name].joint_state(self.clock.stamp)

    @property
    def transforms(self) -> dict[str, Transform]:
        """`odom_from_link` of every link, as tf has it: by the odometry and the joints. `link_poses` has
        where they truly are."""
        odom_from_world = self._robot.odom_from_root @ self.link_pose(self.robot.root).inverse()
        return {link: odom_from_world @ pose for link, pose in self.link_poses().items()}

    def link_pose(self, link: str) -> Transform:
        """`world_from_link`. Raises KbotError for an unknown link."""
        return self._robot.link_pose(link)

    def link_poses(self) -> dict[str, Transform]:
        """`world_from_link` of every link of the robot."""
        return self._robot.link_poses()

    def body_poses(self) -> dict[str, Transform]:
        """`world_from_body` of those bodies of the world that can move."""
        self.refresh()
        return {name: body_pose(self._data, index) for name, index in self._moving.items()}

    def add_sensor(self, sensor: Mountable[S]) -> S:
        """Mount a sensor, as those of kbot.sensors are; returns what it is read by.

        Raises:
            KbotError: it cannot be mounted; the reason is said.
        """
        return sensor.mount(self)

    # state

    def state(self) -> State:
        """Everything that what follows depends on."""
        return State(
            self._steps,
            self._vector(),
            copy_engine(self._model, self._data),
            {name: robot.save() for name, robot in self.robots.items()},
            tuple(self._pushes),
            dict(self.random.bit_generator.state),
        )

    def restore(self, state: State) -> None:
        """Back to a saved state of this simulation; what follows is the same, bit for bit.

        Raises:
            KbotError: the state is another simulation's, or robots came or went since.
        """
        if set(state.robots) != set(self.robots) or len(state.vector) != len(self._vector()):
            raise KbotError("the state is that of another robot or world")
        restore_engine(self._model, self._data, state.engine)
        for name, robot in self.robots.items():
            robot.restore(state.robots[name])
        self._pushes[:] = state.pushes
        self.random.bit_generator.state = state.random
        self._start_at(state.steps)
        self._note("restore")

    def state_sha256(self) -> str:
        """Digest of the engine's state; equal runs have equal ones."""
        return digest(self._vector())

    def _vector(self) -> NDArray[np.float64]:
        return read_engine(self._model, self._data)


def _put_as(new: SimulatedRobot, old: SimulatedRobot, simulation: Simulation) -> None:
    """Let a changed robot stand as it stood before, and go on with what it was told."""
    held = old.joint_positions
    for joint in new.robot.movable_joints:
        lower, upper = limits(joint)
        if joint.name in held and joint.name not in new.held and lower <= held[joint.name] <= upper:
            new.set_position(joint.name, held[joint.name])
    if new.root_qpos >= 0 and old.root_qpos >= 0:
        pose = old.ground_truth.pose
        simulation.set_pose(pose.x, pose.y, pose.yaw, new.name)
    new.take_over(old)


def _robot(robot: object) -> Robot:
    if isinstance(robot, Robot):
        return robot
    if isinstance(robot, str | os.PathLike):
        return load_robot(robot).require()
    raise KbotError(f"a robot, or the file of one, is simulated, not {robot!r}: kbot.load(FILE) reads one")


def _contacts(contacts: str | Contacts) -> Contacts:
    try:
        return Contacts(contacts)
    except ValueError:
        hint = did_you_mean(str(contacts), list(Contacts)) or f"there are {', '.join(Contacts)}"
        raise KbotError(f"there are no contacts '{contacts}': {hint}") from None
