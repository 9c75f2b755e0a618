"""A robot in a world, in simulated time: step it, drive it, read where it is."""

from __future__ import annotations

import os
from typing import Protocol, TypeVar

import mujoco
import numpy as np

from kbot.kinematics.differential_drive import DifferentialDrive, NoDrive
from kbot.kinematics.odometry import PlanarPose, PlanarTwist
from kbot.kinematics.transform import Transform
from kbot.messages.types import JointState
from kbot.model import Robot
from kbot.sim import recipe
from kbot.sim.attached import Attached
from kbot.sim.carry_over import go_on_as
from kbot.sim.disturbed import Disturbed
from kbot.sim.drive.twist_controller import DriveLimits
from kbot.sim.engine.world_builder import body_pose
from kbot.sim.joint_control.kinds import Interface
from kbot.sim.models import Models
from kbot.sim.motion import Motion
from kbot.sim.naming import PLAIN, Naming
from kbot.sim.numbers import shortened
from kbot.sim.preparation import read_robot
from kbot.sim.recipe import Contacts
from kbot.sim.setup import Setup
from kbot.sim.state import State, copy_engine, digest, read_engine, restore_engine
from kbot.text import KbotError
from kbot.text.suggest import did_you_mean
from kbot.world import World, load_world

ORIGIN = PlanarPose()
S = TypeVar("S")
S_co = TypeVar("S_co", covariant=True)


class Mountable(Protocol[S_co]):
    """What can be mounted on a simulated robot."""

    def mount(self, simulation: Simulation) -> S_co: ...


class Simulation(Models, Attached, Disturbed):
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
        naming: Naming = PLAIN,
    ) -> None:
        """`robot` may be the file of one (`kbot` is the one that ships); `timestep` in seconds; `contacts`
        is `recipe` or `as-written`; `limits` stand in for those that the robot's own plugin or controller
        gives; `naming` says what it is called and where its topics and frames are, by default at the root.

        Raises:
            DescriptionError: the robot cannot be simulated; every reason at its line.
            KbotError: no such world, a step or a seed that is none.
        """
        robot, place = read_robot(robot), load_world(world)
        super().__init__(robot, Setup(place, seed, timestep, _contacts(contacts), limits, start, naming))
        self.reset()

    def reset(self) -> None:
        """Back to the start: the same robots and world at time 0, nothing attached, without commands."""
        self._back_to_start()
        self._random = np.random.default_rng(self.seed)
        self._start_at(0)
        self._note("reset")

    def reset_world(self) -> None:
        """As `reset`, but time and what is random go on."""
        time = self._engine.data.time
        self._back_to_start()
        self._engine.data.time = time
        self._start_at(self._steps)
        self._note("reset_world")

    def reset_time(self) -> None:
        """Time is 0 again and everything else goes on as it was; faults come again at their times."""
        steps = self._steps
        self._engine.data.time = 0.0
        pushes = self._disturbances.pushes
        self._disturbances.pushes = tuple(push._replace(until=push.until - steps) for push in pushes)
        for robot in self.robots.values():
            robot._set_back(steps)
        self._start_at(0)
        self._note("reset_time", after=steps)

    def with_robot(self, robot: Robot) -> Simulation:
        """A simulation of a changed robot that goes on where this one stands: its time, pose, joint
        positions, odometry and command, the other robots and things with theirs, and what is attached to each
        other. A robot that would be inside something where it stood begins at its start, where that is free,
        and lets go.

        Raises:
            DescriptionError: the changed robot cannot be simulated; this one is left as it is.
        """
        limits, naming = self._setup.limits, self._setup.naming
        other = Simulation(
            robot, self.world, self.seed, self.timestep, self.contacts, limits, self.start, naming
        )
        other._attach_again(go_on_as(other, self))
        other.changes[:] = self.changes
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

    def set_joint(self, joint: str, position: float, robot: str | None = None) -> None:
        """Hold a joint that does not drive at a position (rad or m) by a servo, within its effort limit.

        Raises:
            KbotError: no such robot or joint, one that drives or follows another, or a number that is not
                finite.
        """
        held = self.named(robot)
        held.dof(joint)
        held._command_joints({joint: position}, Interface.POSITION)
        self._serve(held)
        self._note("set_joint", joint=joint, position=float(position), robot=robot)

    def release_joint(self, joint: str, robot: str | None = None) -> None:
        """Let a held joint move freely again. Raises KbotError for an unknown robot or joint."""
        self.named(robot)._release(joint)
        self._note("release_joint", joint=joint, robot=robot)

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
        return self._robot.twist

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
        _, data = self.engine()
        return {name: body_pose(data, index) for name, index in self._engine.moving.items()}

    def add_sensor(self, sensor: Mountable[S]) -> S:
        """Mount a sensor, as those of kbot.sensors are; returns what it is read by.

        Raises:
            KbotError: it cannot be mounted; the reason is said.
        """
        if not hasattr(sensor, "mount"):
            raise KbotError(f"a sensor is one of kbot.sensors, not {shortened(sensor)}")
        return sensor.mount(self)

    # state

    def state(self) -> State:
        """Everything that what follows depends on."""
        model, data = self._engine.model, self._engine.data
        return State(
            self._steps,
            read_engine(model, data),
            copy_engine(model, data),
            {name: robot._save() for name, robot in self.robots.items()},
            self._disturbances.pushes,
            self._engine.assembly.welds,
            dict(self._random.bit_generator.state),
            self.built,
            self.world,
            tuple(self.changes),
            self.noted,
        )

    def restore(self, state: State) -> None:
        """Back to a saved state of this simulation, with the things that were there; what follows is the
        same, bit for bit.

        Raises:
            KbotError: the state is another simulation's, or robots came or went since.
        """
        if not isinstance(state, State):
            raise KbotError(f"a state is what Simulation.state() gave, not {shortened(state)}")
        assembly, before = self._engine.assembly, self._steps
        is_own = state.built is self.built and set(state.robots) == set(self.robots)
        if is_own and state.world is not assembly.world:
            assembly = assembly.with_world(state.world)
        if state.welds != assembly.welds:
            assembly = assembly.with_welds(state.welds)
        size = len(read_engine(assembly.model, assembly.data))
        if set(state.robots) != set(self.robots) or len(state.vector) != size:
            raise KbotError("the state is that of another robot or world")
        if assembly is not self._engine.assembly:
            self._use(assembly)
        restore_engine(self._engine.model, self._engine.data, state.engine)
        for name, robot in self.robots.items():
            robot._restore(state.robots[name])
        self._disturbances.pushes = state.pushes
        self._random.bit_generator.state = state.random
        self.changes[:] = state.changes
        self._start_at(state.steps)
        self._note("restore", after=before, to=state.steps, noted=state.noted)

    def state_sha256(self) -> str:
        """Digest of the engine's state; equal runs have equal ones."""
        return digest(read_engine(self._engine.model, self._engine.data))

    def _back_to_start(self) -> None:
        if self.attachments:
            self._use(self._engine.assembly.with_welds(()))
        mujoco.mj_resetData(self._engine.model, self._engine.data)
        self._disturbances.pushes = ()
        for robot in self.robots.values():
            self._restart(robot)


def _contacts(contacts: str | Contacts) -> Contacts:
    try:
        return Contacts(contacts)
    except ValueError:
        hint = did_you_mean(str(contacts), list(Contacts)) or f"there are {', '.join(Contacts)}"
        raise KbotError(f"there are no contacts '{contacts}': {hint}") from None
