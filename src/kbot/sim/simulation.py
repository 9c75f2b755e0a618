"""A robot in a world, in simulated time: step it, drive it, read where it is."""

from __future__ import annotations

import dataclasses
import math
import re
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
from kbot.sim.assembly import Assembly, plan_of
from kbot.sim.drive import DriveLimits
from kbot.sim.drive_settings import DriveSettings, drive_settings
from kbot.sim.faults import Fault, Kick
from kbot.sim.joints import limits
from kbot.sim.motion import Motion
from kbot.sim.pushes import Push, Vector, apply
from kbot.sim.recipe import Contacts
from kbot.sim.robot import SimulatedRobot
from kbot.sim.robot_builder import RobotPlan
from kbot.sim.schedule import FOREVER, Schedule
from kbot.sim.state import State, copy_engine, digest, read_engine, restore_engine
from kbot.sim.topics import RobotTopics
from kbot.sim.watch import FASTEST, SimulationDiverged, diverged
from kbot.sim.world_builder import body_pose, moving_bodies
from kbot.text import Diagnostic, KbotError
from kbot.text.suggest import did_you_mean
from kbot.world import World, load_world
from kbot.world.findings import Findings

_NAME = re.compile(r"[A-Za-z]\w*")
S = TypeVar("S")
S_co = TypeVar("S_co", covariant=True)


class Mountable(Protocol[S_co]):
    """What can be mounted on a simulated robot."""

    def mount(self, simulation: Simulation) -> S_co: ...


class Simulation:
    """A robot in a world, and others that may join it.

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
        self._tick_steps = max(1, round(recipe.CONTROL_PERIOD / timestep))
        self._step_ns = timestep * 1e9
        self._limits = limits
        self._slewing: list[SimulatedRobot] = []
        self._pushes: list[Push] = []
        self._schedule = Schedule()
        self.lost_commands = 0.0
        """Share of the commands from outside that are lost, as a fault has it."""
        self._steps, self._fresh = 0, -1
        self._robot, plan, findings = self._prepare(robot, robot.name, PlanarPose(), limits)
        self.robots: dict[str, SimulatedRobot] = {robot.name: self._robot}
        """All robots by name, the first being the one that this object's own methods speak of."""
        self._assembly = Assembly.of(self.world, self.contacts, timestep, {robot.name: plan})
        self.diagnostics = (*self.world.diagnostics, *findings, *self._assembly.diagnostics)
        self._use(self._assembly)
        self._topics = {robot.name: RobotTopics(self.bus, self._robot, tells_time=True)}
        self.reset()

    def _prepare(
        self, robot: Robot, name: str, pose: PlanarPose, limits: DriveLimits | None
    ) -> tuple[SimulatedRobot, RobotPlan, tuple[Diagnostic, ...]]:
        drive = find_drive(robot)
        findings = Findings()
        settings: DriveSettings | None = None
        if isinstance(drive, DifferentialDrive):
            settings = drive_settings(robot, drive, findings)
            if limits is not None:
                settings = dataclasses.replace(settings, limits=limits)
        simulated = SimulatedRobot(name, robot, drive, settings, self.timestep, self)
        plan = plan_of(name, robot, drive, settings, self.contacts, pose)
        return simulated, plan, tuple(findings.diagnostics)

    def _use(self, assembly: Assembly) -> None:
        self._assembly = assembly
        self._model, self._data = assembly.model, assembly.data
        self._qvel = self._data.qvel
        self._moving = moving_bodies(self._model, self.world)
        self._fresh = -1
        for robot in self.robots.values():
            robot.bind(self._model, self._data)
        self._schedule.begin_again(self)

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
        self._pushes.clear()
        for robot in self.robots.values():
            for joint in robot.robot.movable_joints:
                lower, upper = limits(joint)
                if lower <= upper:
                    robot.set_position(joint.name, min(max(0.0, lower), upper))
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

    def _start_at(self, steps: int) -> None:
        self._steps = steps
        self._failure: SimulationDiverged | None = None
        self._next_tick = (steps // self._tick_steps + 1) * self._tick_steps
        self._slewing = [robot for robot in self.robots.values() if robot.is_slewing]
        self._fresh = -1
        self.clock.set(round(steps * self._step_ns))
        self._schedule.jump_to(self, steps)
        self._plan_stop()

    def _plan_stop(self) -> None:
        """Find the step at which something other than physics is due: a control period or a timer."""
        self._planned_due: int = self.clock.next_due
        self._next_stop = self._next_tick
        if self._planned_due < NEVER:
            due = math.ceil(self._planned_due / self._step_ns - 1e-6)
            self._next_stop = min(self._next_tick, max(due, self._steps + 1))
        if self._schedule.entries:
            self._next_stop = min(self._next_stop, self._schedule.next_step(self._steps))
        for push in self._pushes:
            self._next_stop = min(self._next_stop, max(push.until, self._steps + 1))

    def _stop(self) -> None:
        """Do what is due at this step."""
        if self._steps == self._next_tick:
            self._next_tick += self._tick_steps
            # false for NaN too
            if not self._qvel.dot(self._qvel) < FASTEST**2:
                self._fail()
            for robot in self.robots.values():
                if robot.tick(self._steps) and robot not in self._slewing:
                    self._slewing.append(robot)
            for topics in self._topics.values():
                if topics.are_heard:
                    self.clock.advance_to(round(self._steps * self._step_ns))
                    topics.publish(self.clock)
        if self._pushes:
            self._end_pushes()
        if self._schedule.entries:
            self._schedule.bring_to(self, self._steps)
        if self._planned_due < NEVER:
            self.clock.advance_to(round(self._steps * self._step_ns))
        self._plan_stop()

    def _fail(self) -> None:
        last = (self._steps - self._tick_steps) * self.timestep
        self._failure = diverged(self._model, self._data, list(self.robots.values()), self.time, last)
        raise self._failure

    def _end_pushes(self) -> None:
        lasting = [push for push in self._pushes if push.until > self._steps]
        if len(lasting) < len(self._pushes):
            self._pushes[:] = lasting
            apply(self._model, self._data, lasting)

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
        self.take_command(self._robot, linear, angular, None)

    def command(self, linear: float, angular: float, watchdog: float | None = None) -> None:
        """As `cmd_vel`, but taken for lost, and the robot stopped, `watchdog` seconds of simulated time
        after the last one (half a second, unless the robot's controller says otherwise): for commands
        that come from outside, by topic or page."""
        self._robot.command(linear, angular, watchdog)

    def take_command(
        self, robot: SimulatedRobot, linear: float, angular: float, watchdog: float | None
    ) -> None:
        """See `SimulatedRobot.cmd_vel` and `SimulatedRobot.command`."""
        if watchdog is not None and self.lost_commands and self.random.random() < self.lost_commands:
            return
        deadline = None if watchdog is None else self._steps + max(1, round(watchdog / self.timestep))
        if robot.obey(linear, angular, deadline) and robot not in self._slewing:
            self._slewing.append(robot)
        if self.journal is not None:
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

    def set_pose(self, x: float, y: float, yaw: float, robot: str | None = None) -> None:
        """Put the robot somewhere else, standing still on level ground: metres and radians in the world.
        Its odometry does not learn of it.

        Raises:
            KbotError: a number is not finite, no such robot, or it is fixed to the world.
        """
        if not all(math.isfinite(value) for value in (x, y, yaw)):
            raise KbotError(f"a pose is three finite numbers, not {x}, {y}, {yaw}")
        moved = self.named(robot)
        moved.stand_at(x, y, yaw, self._assembly.height(moved.root_qpos))
        self._fresh = -1
        self._note("set_pose", robot=moved.name, x=x, y=y, yaw=yaw)

    def set_twist(self, linear: Vector, angular: Vector = (0.0, 0.0, 0.0), robot: str | None = None) -> None:
        """Give the robot's body a speed at once, as a kick does: m/s and rad/s along the world's axes.

        Raises:
            KbotError: a number is not finite, no such robot, or it is fixed to the world.
        """
        _require_finite("a twist", (*linear, *angular))
        self.named(robot).set_twist(linear, angular)
        self._fresh = -1
        self._note("set_twist", robot=self.named(robot).name, linear=linear, angular=angular)

    def apply_force(
        self,
        link: str,
        force: Vector,
        duration: float,
        torque: Vector = (0.0, 0.0, 0.0),
        robot: str | None = None,
    ) -> None:
        """Push a link with a force (N) and a torque (N m) along the world's axes, at its centre of mass,
        for `duration` seconds.

        Raises:
            KbotError: a number is not finite, no such robot or link, or a duration that is none.
        """
        _require_finite("a force", (*force, *torque))
        if not (math.isfinite(duration) and duration > 0.0):
            raise KbotError(f"a push lasts a finite number of seconds above zero, not {duration}")
        pushed = self.named(robot)
        pushed.body(link)
        until = self._steps + max(1, round(duration / self.timestep))
        self._pushes.append(Push(f"{pushed.name}/{link}", force, torque, until))
        apply(self._model, self._data, self._pushes)
        self._plan_stop()
        self._note("force", robot=pushed.name, link=link, force=force, torque=torque, until=until)

    def schedule(self, fault: Fault, at: float, duration: float | None = None) -> None:
        """Let something go wrong `at` seconds of simulated time, for `duration` seconds (None is for good).
        It stays in the schedule over a reset, and comes again.

        Raises:
            KbotError: a time that is none or is past, or a fault of something that is not there.
        """
        start = round(at / self.timestep) if math.isfinite(at) else -1
        if start < self._steps:
            raise KbotError(f"a fault is placed at a time from now ({self.time:g} s) on, not at {at} s")
        if duration is not None and not (math.isfinite(duration) and duration > 0.0):
            raise KbotError(f"a fault lasts a finite number of seconds above zero, not {duration}")
        stop = FOREVER if duration is None else start + max(1, round(duration / self.timestep))
        if isinstance(fault, Kick):
            stop = start + 1
        elif (end := fault.begin(self)) is not None:
            end()  # begun on trial: what it speaks of is there
        self._schedule.add(fault, start, stop)
        self._schedule.bring_to(self, self._steps)
        self._plan_stop()
        self._note("schedule", fault=repr(fault), at=at, duration=duration)

    # robots that come and go

    def spawn(
        self, robot: Robot, name: str | None = None, x: float = 0.0, y: float = 0.0, yaw: float = 0.0
    ) -> SimulatedRobot:
        """Put one more robot into the running world, at a place on the ground (m, rad).

        Its topics and frames are in the namespace of its name. What runs goes on as it was.

        Raises:
            DescriptionError: the robot cannot be simulated; every reason at its line.
            KbotError: the name is taken or is none, a number is not finite, or the robot would stand
                inside something.
        """
        name = robot.name if name is None else name
        if not _NAME.fullmatch(name):
            raise KbotError(f"'{name}' is no robot's name: letters, digits and _ only, a letter first")
        if name in self.robots:
            raise KbotError(f"there is a robot '{name}' already; give this one another name")
        _require_finite("a pose", (x, y, yaw))
        simulated, plan, findings = self._prepare(robot, name, PlanarPose(x, y, yaw), None)
        assembly = self._assembly.with_robot(plan)
        self.robots[name] = simulated
        self._use(assembly)
        self.diagnostics = (*self.diagnostics, *findings)
        for joint in robot.movable_joints:
            lower, upper = limits(joint)
            if lower <= upper:
                simulated.set_position(joint.name, min(max(0.0, lower), upper))
        simulated.reset()
        self._topics[name] = RobotTopics(self.bus, simulated, namespace=name)
        apply(self._model, self._data, self._pushes)
        self._note("spawn", robot=name, x=x, y=y, yaw=yaw)
        return simulated

    def delete(self, name: str) -> None:
        """Take a robot out of the running world; the first one stays.

        Raises:
            KbotError: there is no such robot, or it is the first.
        """
        gone = self.named(name)
        if gone is self._robot:
            raise KbotError(f"'{name}' is the robot that this simulation is of: it stays")
        del self.robots[name]
        self._topics.pop(name).close()
        self._slewing = [robot for robot in self._slewing if robot is not gone]
        self._pushes = [push for push in self._pushes if not push.body.startswith(f"{name}/")]
        self._use(self._assembly.without_robot(name))
        apply(self._model, self._data, self._pushes)
        self._note("delete", robot=name)

    def named(self, name: str | None = None) -> SimulatedRobot:
        """A robot by name, the first for None. Raises KbotError when there is no such robot."""
        if name is None:
            return self._robot
        if name not in self.robots:
            hint = did_you_mean(name, self.robots) or f"there are {', '.join(self.robots)}"
            raise KbotError(f"there is no robot '{name}': {hint}")
        return self.robots[name]

    def with_robot(self, robot: Robot) -> Simulation:
        """A simulation of a changed robot that goes on where this one stands: its time, pose, joint
        positions, odometry and command, and the other robots with theirs.

        Raises:
            DescriptionError: the changed robot cannot be simulated; this one is left as it is.
        """
        other = Simulation(robot, self.world, self.seed, self.timestep, self.contacts, self._limits)
        _put_as(other._robot, self._robot, other)
        for old in list(self.robots.values())[1:]:
            pose = old.ground_truth.pose
            _put_as(other.spawn(old.robot, old.name, pose.x, pose.y, pose.yaw), old, other)
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
        return self._robot.link_pose(link)

    def link_poses(self) -> dict[str, Transform]:
        """`world_from_link` of every link of the robot."""
        return self._robot.link_poses()

    def body_poses(self) -> dict[str, Transform]:
        """`world_from_body` of those bodies of the world that can move."""
        self.refresh()
        return {name: body_pose(self._data, index) for name, index in self._moving.items()}

    def engine(self) -> tuple[Any, Any]:
        """The engine's model and data with frames as of now, for what measures in them; not to be changed."""
        self.refresh()
        return self._model, self._data

    def add_sensor(self, sensor: Mountable[S]) -> S:
        """Mount a sensor, as those of kbot.sensors are; returns what it is read by.

        Raises:
            KbotError: it cannot be mounted; the reason is said.
        """
        return sensor.mount(self)

    def refresh(self) -> None:
        """Bring the engine's frames up to the positions of now; a step leaves them one behind."""
        if self._fresh != self._steps:
            mujoco.mj_kinematics(self._model, self._data)
            mujoco.mj_comPos(self._model, self._data)
            mujoco.mj_comVel(self._model, self._data)
            self._fresh = self._steps

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
        if joint.name in held and lower <= held[joint.name] <= upper:
            new.set_position(joint.name, held[joint.name])
    if new.root_qpos >= 0 and old.root_qpos >= 0:
        pose = old.ground_truth.pose
        simulation.set_pose(pose.x, pose.y, pose.yaw, new.name)
    new.take_over(old)


def _require_finite(what: str, values: tuple[float, ...]) -> None:
    if not all(math.isfinite(value) for value in values):
        raise KbotError(f"{what} is made of finite numbers, not {values}")


def _contacts(contacts: str | Contacts) -> Contacts:
    try:
        return Contacts(contacts)
    except ValueError:
        hint = did_you_mean(str(contacts), list(Contacts)) or f"there are {', '.join(Contacts)}"
        raise KbotError(f"there are no contacts '{contacts}': {hint}") from None
