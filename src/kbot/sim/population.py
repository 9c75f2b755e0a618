"""A running world whose robots come and go."""

from __future__ import annotations

import dataclasses
import os
from collections.abc import Callable, Mapping, Sequence
from typing import Any

from kbot.kinematics.differential_drive import DifferentialDrive, NoDrive
from kbot.kinematics.odometry import PlanarPose
from kbot.kinematics.steered_drive import find_base
from kbot.kinematics.transform import Transform
from kbot.model import Robot
from kbot.model.load import load_robot
from kbot.model.writer import to_urdf
from kbot.sim.divergence import ELSEWHERE
from kbot.sim.drive.settings import DriveSettings, check_named_joints, drive_settings
from kbot.sim.drive.twist_controller import DriveLimits
from kbot.sim.engine.assembly import Assembly
from kbot.sim.engine.inertia import drive_with_masses
from kbot.sim.engine.joints import rest
from kbot.sim.engine.robot_builder import RobotPlan
from kbot.sim.engine.world_builder import moving_bodies
from kbot.sim.joint_control.commands import joint_command, trajectory_points
from kbot.sim.joint_control.controllers import joint_control, spawned_for
from kbot.sim.naming import Naming, is_model_name
from kbot.sim.numbers import FURTHEST, LONGEST, is_finite, positive, shortened, vector
from kbot.sim.recipe import Contacts
from kbot.sim.robot import SimulatedRobot, driving_joints
from kbot.sim.running import Running
from kbot.sim.topics import RobotTopics
from kbot.text import Diagnostic, KbotError
from kbot.text.suggest import did_you_mean
from kbot.world import World
from kbot.world.findings import Findings


@dataclasses.dataclass(frozen=True, slots=True)
class Setup:
    """What a simulation is of, but for its first robot: as `Simulation` is given it.

    Raises:
        KbotError: a start, or limits, that are none.
    """

    world: World
    seed: int
    timestep: float
    contacts: Contacts
    limits: DriveLimits | None
    start: PlanarPose
    naming: Naming

    def __post_init__(self) -> None:
        start, limits = self.start, self.limits
        if not isinstance(start, PlanarPose):
            raise KbotError(f"a start is a PlanarPose(x, y, yaw) in m and rad, not {shortened(start)}")
        if not (limits is None or isinstance(limits, DriveLimits)):
            raise KbotError(f"limits are DriveLimits(linear_velocity=...), not {shortened(limits)}")
        vector("a start", (start.x, start.y, start.yaw), FURTHEST)


class Population(Running):
    """Robots by name, in an engine's model that is built anew when one comes or goes."""

    def __init__(self, robot: Robot, setup: Setup) -> None:
        world, start, limits, naming = setup.world, setup.start, setup.limits, setup.naming
        super().__init__(world, setup.seed, setup.timestep)
        self.contacts = setup.contacts
        self.lost_commands = 0.0
        """Share of the commands from outside that are lost, as a fault has it."""
        self._limits = limits
        self.start = start
        self.when_robots_change: list[Callable[[], None]] = []
        """Called once a robot came or went."""
        self._naming = naming
        name = naming.name or robot.name
        naming = dataclasses.replace(naming, name=name)
        self._robot, plan, findings = self._prepare(robot, naming, start, limits)
        self.robots = {name: self._robot}
        assembly = Assembly.of(world, self.contacts, self.timestep, {name: plan})
        self._inside = assembly.what_it_is_inside(plan)
        self.diagnostics: tuple[Diagnostic, ...] = (
            *world.diagnostics,
            *findings,
            *assembly.diagnostics,
            *_starts_inside(world, name, self._inside),
        )
        """The warnings that building it gave."""
        self._use(assembly)
        self._topics = {name: RobotTopics(self.bus, self.clock, self._robot, tells_time=True)}

    def named(self, name: str | None = None) -> SimulatedRobot:
        """A robot by name, the first for None. Raises KbotError when there is no such robot."""
        if name is None:
            return self._robot
        if not isinstance(name, str) or name not in self.robots:
            hint = did_you_mean(str(name), self.robots) or f"there are {', '.join(self.robots)}"
            raise KbotError(f"there is no robot {shortened(name)}: {hint}")
        return self.robots[name]

    def spawn_model(
        self,
        robot: Robot | str | os.PathLike[str],
        name: str | None = None,
        x: float = 0.0,
        y: float = 0.0,
        yaw: float = 0.0,
        namespace: str | None = None,
        frame_prefix: str | None = None,
    ) -> SimulatedRobot:
        """Put one more robot, or that of a file, into the running world, at a place on the ground (m, rad).

        Its topics are in its `namespace`, that of its name where none is given; `frame_prefix` stands before
        its frames, by default the namespace, or at the root its name, and a slash. What runs goes on as it
        was.

        Raises:
            DescriptionError: the robot cannot be simulated; every reason at its line.
            KbotError: the name is taken or is none, the namespace is none, a number is not finite, or the
                robot would stand inside something.
        """
        robot = read_robot(robot)
        name = robot.name if name is None else name
        if not is_model_name(name):
            raise KbotError(
                f"{shortened(name)} is no robot's name: letters, digits and _ only, a letter first"
            )
        if name in self.robots:
            raise KbotError(f"there is a robot '{name}' already; give this one another name")
        x, y, yaw = vector("a pose", (x, y, yaw), FURTHEST)
        namespace = name if namespace is None else namespace
        frame_prefix = f"{namespace or name}/" if frame_prefix is None else frame_prefix
        naming = Naming(name, namespace, frame_prefix)
        simulated, plan, findings = self._prepare(robot, naming, PlanarPose(x, y, yaw), None)
        assembly = self._assembly.with_robot(plan)
        self.robots[name] = simulated
        self._use(assembly)
        self.diagnostics = (*self.diagnostics, *findings)
        self._put_joints(simulated)
        simulated.reset()
        if simulated.is_slewing:
            self.serve(simulated)
        self._topics[name] = RobotTopics(self.bus, self.clock, simulated)
        said = {"namespace": namespace, "frame_prefix": frame_prefix, "description": to_urdf(robot)}
        self._note("spawn_model", robot=name, x=x, y=y, yaw=yaw, **said)
        self._robots_changed()
        return simulated

    def _robots_changed(self) -> None:
        for tell in tuple(self.when_robots_change):
            tell()

    def _delete_robot(self, name: str) -> None:
        """Take a robot out. Raises KbotError when it is not there, or is the first."""
        gone = self.named(name)
        if gone is self._robot:
            raise KbotError(f"'{name}' is the robot that this simulation is of: it stays")
        del self.robots[name]
        self._topics.pop(name).close()
        self._slewing = [robot for robot in self._slewing if robot is not gone]
        self._forget(name)
        self._use(self._assembly.without_robot(name))
        self._robots_changed()

    def take_command(
        self, robot: SimulatedRobot, linear: float, angular: float, watchdog: float | None
    ) -> None:
        """See `SimulatedRobot.cmd_vel` and `SimulatedRobot.command`."""
        if not (is_finite(linear) and is_finite(angular)):
            told = f"{shortened(linear)}, {shortened(angular)}"
            raise KbotError(f"a speed command is two finite numbers, not {told}")
        linear, angular = float(linear), float(angular)  # numpy's have no place in a journal
        if watchdog is not None:
            watchdog = positive("a watchdog's time in seconds", watchdog, LONGEST)
        deadline = None if watchdog is None else self._steps + max(1, round(watchdog / self.timestep))
        share = self.lost_commands if watchdog is not None else 0.0
        # what is lost is journalled too: when the run is done again it is drawn for again
        is_lost = share > 0.0 and self.random.random() < share
        if not is_lost and robot.obey(linear, angular, deadline) and robot not in self._slewing:
            self._slewing.append(robot)
        if self.journal is not None:
            self._note("twist", robot=robot.name, linear=linear, angular=angular, deadline=deadline)

    def command_joints(
        self, values: Mapping[str, float], interface: str = "position", robot: str | None = None
    ) -> None:
        """Tell joints that do not drive where to be (`position`, rad or m), how fast to go (`velocity`, rad/s
        or m/s) or what to exert (`effort`, N m or N), within their limits, until they are told otherwise.

        Raises:
            KbotError: no such robot, joint or interface, a joint that drives or follows another, or a number
                that is none.
        """
        told, kind = joint_command(values, interface)
        self.named(robot).take_joint_command(told, kind)
        numbers = {joint: float(value) for joint, value in told.items()}
        self._note("command_joints", values=numbers, interface=str(kind), robot=robot)

    def follow_trajectory(
        self, joints: Sequence[str], points: Sequence[Sequence[Any]], robot: str | None = None
    ) -> None:
        """Let joints go through points, as joint_trajectory_controller does: each a time from now (s), then
        positions (rad or m) in the order of `joints`, and if wanted velocities and accelerations. Without
        points they stay where they are.

        Raises:
            KbotError: no such robot or joint, one that drives or follows another, points of the wrong shape,
                or times that do not grow.
        """
        names, way = trajectory_points(joints, points)
        self.named(robot).take_trajectory(names, way, self._steps)
        self._note("follow_trajectory", joints=list(names), points=[list(p) for p in way], robot=robot)

    def _forget(self, name: str) -> None:
        """Drop what is done to a robot, or to a body by its name in the engine, that goes."""

    def _model_is_new(self) -> None:
        """Do in the new model what was done in the old one."""

    def _prepare(
        self, robot: Robot, naming: Naming, pose: PlanarPose, limits: DriveLimits | None
    ) -> tuple[SimulatedRobot, RobotPlan, tuple[Diagnostic, ...]]:
        drive = drive_with_masses(robot, _base(robot))
        findings = Findings()
        check_named_joints(robot, findings)
        settings: DriveSettings | None = None
        if isinstance(drive, DifferentialDrive):
            settings = drive_settings(robot, drive, findings, naming)
            if limits is not None:
                settings = dataclasses.replace(settings, limits=limits)
        driven = driving_joints(drive)
        name = naming.name
        # topics that gz names by the model bear its name in the world
        control = joint_control(dataclasses.replace(robot, name=name), driven, findings, naming)
        simulated = SimulatedRobot(name, robot, drive, settings, self.timestep, self, control, naming)
        place = Transform.from_xyz_rpy((pose.x, pose.y, 0.0), (0.0, 0.0, pose.yaw))
        torque = settings.torque if settings is not None else None
        plan = RobotPlan(name, robot, drive, self.contacts, place, others=False, torque=torque)
        return simulated, plan, tuple(findings.diagnostics)

    def _use(self, assembly: Assembly) -> None:
        self._assembly = assembly
        self.world = assembly.world
        self._model, self._data = assembly.model, assembly.data
        self._qvel = self._data.qvel
        self._moving = moving_bodies(self._model, self.world)
        self._fresh = self._seen = -1
        for robot in self.robots.values():
            robot.bind(self._model, self._data)
        self._model_is_new()

    @staticmethod
    def _put_joints(robot: SimulatedRobot) -> None:
        """At 0, or at the end of a range that leaves it out which is nearest."""
        for joint in robot.robot.movable_joints:
            if joint.name not in robot.held:
                robot._set_position(joint.name, rest(joint))


def controller_findings(robot: Robot) -> tuple[Diagnostic, ...]:
    """What is wrong with the controllers of a robot, before it is simulated."""
    findings = Findings()
    joint_control(robot, driving_joints(_base(robot)), findings)
    return tuple(findings.diagnostics)


def _base(robot: Robot) -> DifferentialDrive | NoDrive:
    """What drives a robot, unless a launch has its wheels commanded one by one."""
    drive = find_base(robot)
    reason = spawned_for(robot, driving_joints(drive))
    return NoDrive(reason) if reason else drive


def _starts_inside(world: World, robot: str, inside: str) -> tuple[Diagnostic, ...]:
    findings = Findings()
    if inside:
        findings.warning(
            "W111",
            f"robot '{robot}' starts inside '{inside}' of the world",
            next((body.origin for body in world.bodies if body.name == inside), None),
            ELSEWHERE,
        )
    return tuple(findings.diagnostics)


def read_robot(robot: object) -> Robot:
    """A robot, or that of a file. Raises KbotError, or DescriptionError with all that is wrong in it."""
    if isinstance(robot, Robot):
        return robot
    if isinstance(robot, str | os.PathLike):
        return load_robot(robot).require()
    raise KbotError(
        f"a robot, or the file of one, is simulated, not {shortened(robot)}: kbot.load(FILE) reads one"
    )
