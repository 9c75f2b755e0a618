"""A robot in a world, in simulated time: step it, drive it, read where it is."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Callable, Mapping
from typing import Any, Protocol, TypeVar

import mujoco
import numpy as np
from numpy.typing import NDArray

from kbot.kinematics.differential_drive import DifferentialDrive, NoDrive, find_drive
from kbot.kinematics.odometry import PlanarPose, PlanarTwist
from kbot.kinematics.transform import Transform
from kbot.messages.bus import Bus
from kbot.messages.clock import NEVER, Clock
from kbot.model import Robot
from kbot.sim import recipe
from kbot.sim.compile import compile_model
from kbot.sim.drive import DriveLimits
from kbot.sim.drive_settings import DriveSettings, drive_settings
from kbot.sim.joints import limits
from kbot.sim.motion import Motion
from kbot.sim.placing import lowest_point
from kbot.sim.recipe import Contacts
from kbot.sim.robot import SimulatedRobot
from kbot.sim.robot_builder import RobotPlan
from kbot.sim.state import State, digest, read_engine, write_engine
from kbot.sim.topics import RobotTopics
from kbot.sim.watch import FASTEST, SimulationDiverged, diverged
from kbot.sim.world_builder import body_pose, moving_bodies
from kbot.text import Diagnostic, KbotError
from kbot.text.suggest import did_you_mean
from kbot.world import World, load_world
from kbot.world.findings import Findings

S = TypeVar("S")
S_co = TypeVar("S_co", covariant=True)


class Mountable(Protocol[S_co]):
    """What can be mounted on a simulated robot."""

    def mount(self, simulation: Simulation) -> S_co: ...


class Simulation:
    """One robot in a world.

    Time passes only in `step` and `run`; the same robot, world, seed and commands give the same bytes.
    The world's frame is that of the odometry at the start: x ahead, y left, z up, in metres.
    `diagnostics` are the warnings that building it gave.
    """

    def __init__(
        self,
        robot: Robot,
        world: str | World = "empty",
        seed: int = 0,
        timestep: float = recipe.TIMESTEP,
        contacts: str | Contacts = Contacts.RECIPE,
        limits: DriveLimits | None = None,
    ) -> None:
        """`timestep` in seconds; `contacts` is `recipe` or `as-written`; `limits` stand in for those that
        the robot's own plugin or controller gives.

        Raises:
            DescriptionError: the robot cannot be simulated; every reason at its line.
            KbotError: no such world, a step or a seed that is none.
        """
        if not 1e-5 <= timestep <= 0.02:
            raise KbotError(f"a step is 0.00001 to 0.02 seconds long, not {timestep}")
        if seed < 0:
            raise KbotError(f"a seed is a whole number from 0 on, not {seed}")
        self.world = load_world(world)
        self.seed = seed
        self.timestep = timestep
        self.contacts = _contacts(contacts)
        self.clock = Clock()
        self.bus = Bus()
        self.random = np.random.default_rng(seed)
        self.journal: Callable[[str, dict[str, Any]], None] | None = None
        """Told of all that is done to the simulation from outside, once it is done: what, and its numbers."""
        drive = find_drive(robot)
        self._tick_steps = max(1, round(recipe.CONTROL_PERIOD / timestep))
        findings = Findings()
        settings: DriveSettings | None = None
        if isinstance(drive, DifferentialDrive):
            settings = drive_settings(robot, drive, findings)
            if limits is not None:
                settings = dataclasses.replace(settings, limits=limits)
        self._robot = SimulatedRobot(robot.name, robot, drive, settings, timestep)
        self._robots = {robot.name: self._robot}
        self._step_ns = timestep * 1e9
        self._limits = limits
        self._slewing: list[SimulatedRobot] = []
        self.diagnostics = (
            *self.world.diagnostics,
            *findings.diagnostics,
            *self._build(robot, drive, settings),
        )
        self._topics = RobotTopics(self.bus, self._robot, self.command)
        self.reset()

    def _build(
        self, robot: Robot, drive: DifferentialDrive | NoDrive, settings: DriveSettings | None
    ) -> tuple[Diagnostic, ...]:
        torque = settings.torque if settings is not None else None
        plan = RobotPlan(
            robot.name, robot, drive, self.contacts, Transform.identity(), others=False, torque=torque
        )
        self._model, diagnostics = compile_model(self.world, [plan], self.timestep)
        self._data = mujoco.MjData(self._model)
        self._qvel = self._data.qvel
        self._moving = moving_bodies(self._model, self.world)
        self._robot.bind(self._model, self._data)
        mujoco.mj_kinematics(self._model, self._data)
        lowest = lowest_point(self._model, self._data, plan.prefix)
        if lowest is not None and robot.root != "world":
            self._model.qpos0[self._robot.root_qpos + 2] -= lowest
        return diagnostics

    # time

    @property
    def time(self) -> float:
        """Seconds since the start."""
        return self._steps * self.timestep

    @property
    def steps(self) -> int:
        return self._steps

    def step(self, n: int = 1) -> None:
        """Go on by `n` steps.

        Raises:
            SimulationDiverged: the run left the physical; says when, which link, and the likely cause.
        """
        if self._failure is not None:
            raise self._failure
        if self.clock.next_due != self._planned_due:
            self._plan_stop()
        model, data, mj_step = self._model, self._data, mujoco.mj_step
        while n > 0:
            count = self._next_stop - self._steps
            if count > n:
                count = n
            if self._slewing:
                count = min(count, self._slew())
            mj_step(model, data, count)
            self._steps += count
            n -= count
            if self._steps == self._next_stop:
                self._stop()
        self.clock.advance_to(round(self._steps * self._step_ns))

    def run(self, seconds: float) -> None:
        """Go on by a time, rounded to whole steps.

        Raises:
            KbotError: the time is negative or not finite.
            SimulationDiverged: as for `step`.
        """
        if not (math.isfinite(seconds) and seconds >= 0.0):
            raise KbotError(f"a time to run is a finite number of seconds from 0 on, not {seconds}")
        self.step(round(seconds / self.timestep))

    def reset(self) -> None:
        """Back to the start: the same robot and world at time 0, without commands."""
        mujoco.mj_resetData(self._model, self._data)
        for joint in self._robot.robot.movable_joints:
            lower, upper = limits(joint)
            if lower <= upper:
                self._robot.set_position(joint.name, min(max(0.0, lower), upper))
        self._robot.reset()
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

    def _start_at(self, steps: int) -> None:
        self._steps = steps
        self._failure: SimulationDiverged | None = None
        self._next_tick = (steps // self._tick_steps + 1) * self._tick_steps
        self._slewing = [robot for robot in self._robots.values() if robot.is_slewing]
        self._fresh = -1
        self.clock.set(round(steps * self._step_ns))
        self._plan_stop()

    def _plan_stop(self) -> None:
        """Find the step at which something other than physics is due: a control period or a timer."""
        self._planned_due: int = self.clock.next_due
        self._next_stop = self._next_tick
        if self._planned_due < NEVER:
            due = math.ceil(self._planned_due / self._step_ns - 1e-6)
            self._next_stop = min(self._next_tick, max(due, self._steps + 1))

    def _stop(self) -> None:
        """Do what is due at this step."""
        if self._steps == self._next_tick:
            self._next_tick += self._tick_steps
            # false for NaN too
            if not self._qvel.dot(self._qvel) < FASTEST**2:
                self._fail()
            for robot in self._robots.values():
                if robot.tick(self._steps) and robot not in self._slewing:
                    self._slewing.append(robot)
            if self._topics.are_heard:
                self.clock.advance_to(round(self._steps * self._step_ns))
                self._topics.publish(self.clock)
        if self._planned_due < NEVER:
            self.clock.advance_to(round(self._steps * self._step_ns))
        self._plan_stop()

    def _fail(self) -> None:
        last = (self._steps - self._tick_steps) * self.timestep
        self._failure = diverged(self._model, self._data, list(self._robots.values()), self.time, last)
        raise self._failure

    def _slew(self) -> int:
        """Serve the robots that follow a new command; steps until the next of them is due."""
        wait = self._tick_steps
        for robot in tuple(self._slewing):
            due = robot.slew(self._steps)
            if due:
                wait = min(wait, due)
            else:
                self._slewing.remove(robot)
        return wait

    # commands

    def cmd_vel(self, linear: float, angular: float) -> None:
        """Drive forward at `linear` m/s while turning at `angular` rad/s, until told otherwise.

        Raises:
            KbotError: the robot cannot drive (the reason is said), or a number is not finite.
        """
        self._command(self._robot, linear, angular, None)

    def command(self, linear: float, angular: float, watchdog: float | None = None) -> None:
        """As `cmd_vel`, but taken for lost, and the robot stopped, `watchdog` seconds of simulated time
        after the last one (half a second, unless the robot's controller says otherwise): for commands
        that come from outside, by topic or page."""
        if watchdog is None:
            settings = self._robot.settings
            watchdog = settings.watchdog if settings is not None else recipe.WATCHDOG
        deadline = self._steps + max(1, round(watchdog / self.timestep))
        self._command(self._robot, linear, angular, deadline)

    def _command(self, robot: SimulatedRobot, linear: float, angular: float, deadline: int | None) -> None:
        if robot.command(linear, angular, deadline) and robot not in self._slewing:
            self._slewing.append(robot)
        self._note("twist", robot=robot.name, linear=linear, angular=angular, deadline=deadline)

    def _note(self, what: str, **numbers: object) -> None:
        if self.journal is not None:
            self.journal(what, numbers)

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

    def set_pose(self, x: float, y: float, yaw: float) -> None:
        """Put the robot somewhere else, standing still on level ground: metres and radians in the world.
        Its odometry does not learn of it.

        Raises:
            KbotError: a number is not finite, or the robot is fixed to the world.
        """
        if not all(math.isfinite(value) for value in (x, y, yaw)):
            raise KbotError(f"a pose is three finite numbers, not {x}, {y}, {yaw}")
        self._refresh()
        self._robot.stand_at(x, y, yaw, float(self._model.qpos0[self._robot.root_qpos + 2]))
        self._fresh = -1
        self._note("set_pose", x=x, y=y, yaw=yaw)

    def with_robot(self, robot: Robot) -> Simulation:
        """A simulation of a changed robot that goes on where this one stands: its time, pose, joint
        positions, odometry and command.

        Raises:
            DescriptionError: the changed robot cannot be simulated; this one is left as it is.
        """
        other = Simulation(robot, self.world, self.seed, self.timestep, self.contacts, self._limits)
        held = self.joint_positions
        for joint in robot.movable_joints:
            lower, upper = limits(joint)
            if joint.name in held and lower <= held[joint.name] <= upper:
                other._robot.set_position(joint.name, held[joint.name])
        if other._robot.root_qpos >= 0 and self._robot.root_qpos >= 0:
            pose = self.ground_truth.pose
            other.set_pose(pose.x, pose.y, pose.yaw)
        other._robot.take_over(self._robot)
        other._start_at(self._steps)
        return other

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
        self._refresh()
        return self._robot.ground_truth

    @property
    def joint_positions(self) -> dict[str, float]:
        """rad or m, by joint."""
        return self._robot.joint_positions

    @property
    def joint_velocities(self) -> dict[str, float]:
        """rad/s or m/s, by joint."""
        return self._robot.joint_velocities

    def link_pose(self, link: str) -> Transform:
        """`world_from_link`. Raises KbotError for an unknown link."""
        self._refresh()
        return self._robot.link_pose(link)

    def link_poses(self) -> dict[str, Transform]:
        """`world_from_link` of every link of the robot."""
        self._refresh()
        return {link: self._robot.link_pose(link) for link in self._robot.links}

    def body_poses(self) -> dict[str, Transform]:
        """`world_from_body` of those bodies of the world that can move."""
        self._refresh()
        return {name: body_pose(self._data, index) for name, index in self._moving.items()}

    def engine(self) -> tuple[Any, Any]:
        """The engine's model and data with frames as of now, for what measures in them; not to be changed."""
        self._refresh()
        return self._model, self._data

    def add_sensor(self, sensor: Mountable[S]) -> S:
        """Mount a sensor, as those of kbot.sensors are; returns what it is read by.

        Raises:
            KbotError: it cannot be mounted; the reason is said.
        """
        return sensor.mount(self)

    def _refresh(self) -> None:
        """Bring the engine's frames up to the positions of now; a step leaves them one behind."""
        if self._fresh != self._steps:
            mujoco.mj_kinematics(self._model, self._data)
            mujoco.mj_comPos(self._model, self._data)
            mujoco.mj_comVel(self._model, self._data)
            self._fresh = self._steps

    # state

    def state(self) -> State:
        """Everything that what follows depends on."""
        engine = read_engine(self._model, self._data)
        return State(self._steps, engine, {self._robot.name: self._robot.save()}, self._random_state())

    def restore(self, state: State) -> None:
        """Back to a saved state of this simulation; what follows is the same, bit for bit.

        Raises:
            KbotError: the state is another simulation's.
        """
        if set(state.robots) != {self._robot.name} or len(state.engine) != len(self._vector()):
            raise KbotError("the state is that of another robot or world")
        write_engine(self._model, self._data, state.engine)
        self._robot.restore(state.robots[self._robot.name])
        self.random.bit_generator.state = state.random
        self._start_at(state.steps)
        self._note("restore")

    def state_sha256(self) -> str:
        """Digest of the engine's state; equal runs have equal ones."""
        return digest(self._vector())

    def _vector(self) -> NDArray[np.float64]:
        return read_engine(self._model, self._data)

    def _random_state(self) -> dict[str, Any]:
        return dict(self.random.bit_generator.state)


def _contacts(contacts: str | Contacts) -> Contacts:
    try:
        return Contacts(contacts)
    except ValueError:
        hint = did_you_mean(str(contacts), list(Contacts)) or f"there are {', '.join(Contacts)}"
        raise KbotError(f"there are no contacts '{contacts}': {hint}") from None
