"""The class Simulation: a robot in a world, in simulated time."""

from __future__ import annotations

import dataclasses
import os
import reprlib
from collections.abc import Callable, Iterator, Sequence
from typing import Any, Protocol, TypeVar

from kbot.brief import Brief, counted
from kbot.extensions import LivePage, NotebookView, live_page, notebook
from kbot.kinematics.planar_pose import PlanarPose
from kbot.kinematics.transform import Transform
from kbot.messages.bus import Bus
from kbot.messages.clock import Clock
from kbot.messages.types import JointState
from kbot.model import RobotModel
from kbot.robot import Robot
from kbot.sim import recipe
from kbot.sim.command_delivery import CommandDelivery
from kbot.sim.disturbances import Disturbances
from kbot.sim.drawings import Drawings
from kbot.sim.drive.twist_controller import DriveLimits
from kbot.sim.engine.assembly import Assembly
from kbot.sim.engine.engine import Engine
from kbot.sim.journal import Journal
from kbot.sim.models import Models
from kbot.sim.motion_findings import MotionFindings
from kbot.sim.motion_watch import MotionWatch
from kbot.sim.naming import ROOT_NAMING, Naming
from kbot.sim.plots import Plots
from kbot.sim.preparation import check_settings, prepare, read_robot
from kbot.sim.printed_lines import PrintedLines
from kbot.sim.recipe import Contacts
from kbot.sim.robot import SimulatedRobot
from kbot.sim.robots import Robots
from kbot.sim.snapshots import Snapshot, Snapshots
from kbot.sim.start_findings import starts_inside, without_ground
from kbot.sim.stepping import Stepping
from kbot.sim.topics import joint_state
from kbot.sim.wheel_odometry import Motion
from kbot.text import Diagnostic, KbotError
from kbot.text.suggest import did_you_mean
from kbot.world import World, load_world

ORIGIN = PlanarPose()
S = TypeVar("S")
S_co = TypeVar("S_co", covariant=True)


class Mountable(Protocol[S_co]):
    """What can be mounted on a simulated robot."""

    def mount(self, simulation: Simulation) -> S_co: ...


class Simulation(Brief):
    """A robot in a world. More robots can be spawned.

    Time advances only in `step` and `run`. The same robot, world, seed and commands give the same bytes. The
    world's frame is the odometry frame at the start: x forward, y left, z up, in metres.

    The methods of this class command and read the first robot. Its parts do the rest: `robots` (each robot by
    name), `models` (spawn, delete and move robots and objects), `disturbances` (pushes and faults),
    `snapshots` (partial resets), `stepping`, `commands`, `journal` and `engine` (MuJoCo's model and data).
    """

    def __init__(
        self,
        robot: RobotModel | str | os.PathLike[str],
        world: str | World = "empty",
        seed: int = 0,
        timestep: float = recipe.TIMESTEP,
        contacts: str | Contacts = Contacts.RECIPE,
        limits: DriveLimits | None = None,
        start: PlanarPose | None = None,
        naming: Naming = ROOT_NAMING,
    ) -> None:
        """Simulate a robot in a world. `robot` is a model or a file name; `kbot` ships with KBot.

        `timestep` is in seconds. `contacts` is `recipe` or `as-written`. `limits` replace those of the
        robot's own plugin or controller. `start` is by default the origin, or the nearest place at which the
        robot overlaps nothing. `naming` sets the robot's name and the namespace of its topics and
        frames, by default the root.

        Raises:
            DescriptionError: the robot cannot be simulated. It carries every reason with its line.
            KbotError: the world does not exist, or another argument is not valid.
        """
        robot, place, contacts = read_robot(robot), load_world(world), _contacts(contacts)
        check_settings(seed, timestep, limits, ORIGIN if start is None else start)
        self.seed, self.timestep, self.contacts = seed, timestep, contacts
        self._limits, self._naming = limits, naming
        self.bus = Bus()
        self.clock = Clock()
        self.paused = False
        """Whether the page and the bridges, which run in real time, wait. `step` and `run` still work."""
        self.errands: list[Callable[[], bool]] = []
        """Called by `run_errands`. Each returns whether it did something."""
        self.mounted: dict[str, Any] = {}  # each key has a value of its own type
        """What was added once for all users of this simulation, such as the robot's declared sensors."""
        self.draw = Drawings(self.bus, self.clock)
        """Points, lines and text in the scene: `sim.draw.points("goal", [(1.0, 0.5)], color="red")`."""
        self.printed = PrintedLines(self.bus, self.clock)
        """The lines that the user's program prints."""
        self._plots = Plots(self.bus)
        self.driver_findings: list[Diagnostic] = []
        """Findings about what drives the first robot, such as a policy. A reset does not clear them."""
        name = naming.name or robot.name
        self.start = ORIGIN if start is None else start
        prepared = prepare(robot, dataclasses.replace(naming, name=name), self.start, limits, contacts)
        assembly = Assembly.of(place, contacts, timestep, {name: prepared.plan})
        overlapped = inside = assembly.overlapped_by(prepared.plan)
        free = assembly.free_place(prepared.plan) if inside and start is None else None
        if free is not None:
            self.start, inside = PlanarPose(*free), ""
            there = Transform.from_xyz_rpy((*free, 0.0), (0.0, 0.0, 0.0))
            prepared = dataclasses.replace(prepared, plan=dataclasses.replace(prepared.plan, pose=there))
            assembly = assembly.with_start(prepared.plan)
        off_ground = without_ground(place, name, prepared, assembly)
        warnings = (
            *place.diagnostics,
            *prepared.findings,
            *assembly.diagnostics,
            *starts_inside(place, name, overlapped, free),
            *filter(None, [off_ground]),
        )
        # topics are listed, and timers of one time run, in order of creation: the first robot's come first
        self.engine = Engine(assembly)
        self.journal = Journal()
        self.commands = CommandDelivery(self.engine, seed)
        self.robots = Robots(prepared, self.engine, self.bus, self.clock, self.commands, self.journal)
        self._first: SimulatedRobot = self.robots.first
        self.disturbances = Disturbances(self.engine, self.bus, self.robots, self.commands, self.journal)
        self.models = Models(
            self.engine, self.robots, self.commands, self.disturbances, self.journal, warnings
        )
        self._watch = MotionWatch(self.engine, self.robots, self.disturbances)
        self._findings = MotionFindings(self._watch, self.engine, self._first, off_ground)
        self.stepping = Stepping(
            self.engine, self.clock, self.commands, self.robots, self.disturbances, self._watch, inside
        )
        self.snapshots = Snapshots(
            self.engine,
            self.commands,
            self.robots,
            self.disturbances,
            self.models,
            self.stepping,
            self.journal,
        )
        self.snapshots.reset()

    # time

    def step(self, n: int = 1) -> None:
        """Advance by `n` steps.

        Raises:
            KbotError: `n` is not a whole number of at least 0.
            SimulationDiverged: a link flew off. The error names the time, the link and the likely cause.
        """
        self.stepping.step(n)

    def run(self, seconds: float) -> None:
        """Advance by a time, rounded to the nearest whole number of time steps.

        Each call is rounded on its own: with a time step of 2 ms, 60 calls of `run(1 / 60)` take 60 times 8
        steps, 0.96 s. `run(end - sim.time)` does not add up such errors.

        Raises:
            KbotError: the time is negative or not finite, or it is above 0 and rounds to no step.
            SimulationDiverged: as for `step`.
        """
        self.stepping.run(seconds)

    @property
    def time(self) -> float:
        """Seconds since the start."""
        return self.engine.time

    @property
    def steps(self) -> int:
        return self.engine.steps

    def run_errands(self) -> bool:
        """Call all `errands`. Returns whether any of them did something.

        A loop that runs in real time calls this between steps, also while the simulation is `paused`. An
        errand may reset the run, or spawn and delete robots.
        """
        return sum(errand() for errand in tuple(self.errands)) > 0

    def plot(self, name: str, value: float) -> None:
        """Publish a value on `/plot/NAME`. The page plots it over time, and recordings contain it.

        Raises:
            KbotError: the name has other characters than letters, digits, `_` and `/`, there are too many
                names, or the value is not a number.
        """
        self._plots.add(name, value)

    # the first robot

    def cmd_vel(self, linear: float, angular: float, lateral: float = 0.0) -> None:
        """Drive forward at `linear` m/s while turning at `angular` rad/s, until the next command.

        A holonomic base also drives to the left at `lateral` m/s.

        Raises:
            KbotError: the robot cannot drive, or cannot drive sideways (the message gives the reason), or a
                number is not finite.
        """
        self._first.send_twist(linear, angular, None, lateral)

    @property
    def robot(self) -> Robot:
        """The first robot's description, as `kbot.load` returns it."""
        return self._first.robot

    @property
    def odometry(self) -> Motion:
        """The base's `pose` in the odometry frame and `twist` in its own frame, computed from the wheels.

        The yaw of the pose is above -pi and at most pi. `unwrapped_yaw` counts full turns.
        """
        return self._first.odometry

    @property
    def ground_truth(self) -> Motion:
        """The base's true `pose` in the world and its `twist` in its own frame.

        The yaw of the pose is above -pi and at most pi. `unwrapped_yaw` counts full turns.
        """
        return self._first.ground_truth

    @property
    def collided(self) -> bool:
        """Whether the robot has touched anything except the ground since the last reset or placement.

        The ground is defined as for goals: `Collisions` in `kbot.sim.collisions`. Contacts are read every
        0.08 s.
        """
        return bool(self._watch.touched)

    @property
    def findings(self) -> tuple[Diagnostic, ...]:
        """How the run of the first robot differs from its commands and odometry, with the cause if one is
        known that explains the size of the difference.

        W301: odometry is wrong. W302: the robot hardly moves though it is commanded. W303: it fell over.
        W304: it is below the floor. W305: its command is far above what the drive allows. A reset or another
        placement of the robot clears them. W308: its policy is faster than the robot. W309: the physics
        engine made an error.
        """
        return (*self._findings.find(), *self.driver_findings)

    @property
    def joint_positions(self) -> dict[str, float]:
        """Position in rad or m by joint."""
        return self._first.body.joint_positions

    @property
    def joint_states(self) -> JointState:
        """The message of the topic `joint_states` at the current time."""
        return joint_state(self._first, self.clock.stamp)

    @property
    def transforms(self) -> dict[str, Transform]:
        """`odom_from_link` of every link by odometry and joints, as on tf.

        `link_poses` has the true poses.
        """
        first = self._first
        odom_from_world = first.odom_from_root @ first.body.link_pose(first.robot.root).inverse()
        return {link: odom_from_world @ pose for link, pose in first.body.link_poses().items()}

    def link_pose(self, link: str) -> Transform:
        """`world_from_link`, its true pose. Raises KbotError for an unknown link."""
        return self._first.body.link_pose(link)

    def link_poses(self) -> dict[str, Transform]:
        """`world_from_link` of every link of the robot, their true poses."""
        return self._first.body.link_poses()

    def add_sensor(self, sensor: Mountable[S]) -> S:
        """Mount a sensor of kbot.sensors. Returns the object that reads it.

        Raises:
            KbotError: the sensor cannot be mounted. The message gives the reason.
        """
        if not hasattr(sensor, "mount"):
            raise KbotError(f"a sensor must be one of kbot.sensors, not {reprlib.repr(sensor)}")
        return sensor.mount(self)

    # the whole simulation

    @property
    def world(self) -> World:
        """The current world, with spawned and without deleted objects."""
        return self.engine.world

    @property
    def diagnostics(self) -> tuple[Diagnostic, ...]:
        """The warnings from building the world and its robots. `findings` are those about the run."""
        return self.models.diagnostics

    def reset(self) -> None:
        """Reset to time 0: the same robots and world, without commands, attachments and drawings."""
        self.snapshots.reset()
        self.draw.clear()

    def state(self) -> Snapshot:
        """Save everything that determines how the run continues."""
        return self.snapshots.take()

    def restore(self, state: Snapshot) -> None:
        """Restore a saved state and its objects. The run continues from it bit for bit.

        Raises:
            KbotError: the state is from another simulation, or robots were spawned or deleted since.
        """
        self.snapshots.restore(state)

    def state_sha256(self) -> str:
        """Digest of the engine's state. Equal runs have equal digests."""
        return self.snapshots.sha256()

    def with_robot(self, robot: RobotModel) -> Simulation:
        """A simulation of a changed robot that continues from the current state.

        It keeps the time, the robot's pose, joint positions, odometry and command, the other robots and
        objects, and attachments. A robot that would overlap something is moved to its start, if that is free,
        and is detached from everything.

        Raises:
            DescriptionError: the changed robot cannot be simulated. This simulation is not changed.
        """
        other = Simulation(
            robot,
            self.world,
            self.seed,
            self.timestep,
            self.contacts,
            self._limits,
            self.start,
            self._naming,
        )
        other.models.continue_from(self.models, self.start)
        other.journal.changes[:] = self.journal.changes
        other.stepping.jump(self.engine.steps)
        return other

    def serve(self, *, browser: bool = True, host: str = "127.0.0.1", port: int | None = None) -> LivePage:
        """Show this simulation live in a page, and print the address.

        From now on `run` and `step` keep real time, and the page's speed and pause. What the program prints,
        plots and draws appears in the page. The page answers while the simulation steps.

            with sim.serve() as page:
                drive(sim)
                page.wait()    # until Ctrl-C

        `browser` opens a browser and waits for its page, at most 10 s. `port` None takes the first free port
        from 8300. If other machines can reach `host`, the address has a token.

        Raises:
            KbotError: the simulation is already served, or the address is in use.
        """
        page: LivePage = live_page().serve(self, browser=browser, host=host, port=port)
        return page

    def show(self, snapshots: Sequence[Snapshot] = (), *, height: int = 480) -> NotebookView:
        """Show the robot in its world in a notebook. `height` is in pixels.

        `snapshots` are results of `state()` in order of time. A slider selects one of them.

            snapshots = []
            for _ in range(100):
                sim.run(0.05)
                snapshots.append(sim.state())
            sim.show(snapshots)

        Raises:
            KbotError: a snapshot is from another simulation.
        """
        view: NotebookView = notebook().show_simulation(self, snapshots, height)
        return view

    def _shown(self) -> Iterator[str]:
        yield repr(self._first.name)
        if len(self.robots) > 1:
            yield counted(len(self.robots), "robot")
        yield f"world={self.world.name!r}"
        yield f"time={self.time:g}"
        yield f"seed={self.seed}"


def _contacts(contacts: str | Contacts) -> Contacts:
    try:
        return Contacts(contacts)
    except ValueError:
        hint = did_you_mean(str(contacts), list(Contacts)) or f"choose from {', '.join(Contacts)}"
        raise KbotError(f"unknown contacts '{contacts}': {hint}") from None
