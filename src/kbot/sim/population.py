"""A running world whose robots come and go."""

from __future__ import annotations

import dataclasses
import os
from collections.abc import Callable, Mapping, Sequence
from typing import Any

from kbot.kinematics.odometry import PlanarPose
from kbot.model import Robot
from kbot.model.writer import to_urdf
from kbot.sim.divergence import ELSEWHERE
from kbot.sim.engine.assembly import Assembly
from kbot.sim.engine.engine import Engine
from kbot.sim.engine.joints import rest
from kbot.sim.engine.welds import STANDING
from kbot.sim.engine.world_builder import PREFIX
from kbot.sim.joint_control.commands import joint_command, trajectory_points
from kbot.sim.naming import Naming, is_model_name
from kbot.sim.numbers import FURTHEST, LONGEST, is_finite, positive, shortened, vector
from kbot.sim.preparation import Prepared, prepare, read_robot
from kbot.sim.robot import SimulatedRobot
from kbot.sim.running import Running
from kbot.sim.setup import Setup
from kbot.sim.topics import RobotTopics
from kbot.text import Diagnostic, KbotError
from kbot.text.suggest import did_you_mean
from kbot.world import World
from kbot.world.findings import Findings


class Population(Running):
    """Robots by name, in an engine's model that is built anew when one comes or goes."""

    def __init__(self, robot: Robot, setup: Setup) -> None:
        """Raises DescriptionError: the robot cannot be simulated."""
        world = setup.world
        name = setup.naming.name or robot.name
        naming = dataclasses.replace(setup.naming, name=name)
        prepared = prepare(robot, naming, setup.start, setup.limits, setup.contacts)
        assembly = Assembly.of(world, setup.contacts, setup.timestep, {name: prepared.plan})
        super().__init__(Engine(assembly), setup.seed, setup.timestep)
        self._setup, self.contacts, self.start = setup, setup.contacts, setup.start
        self.when_robots_change: list[Callable[[], None]] = []
        """Called once a robot came or went."""
        self._robot = self._add_robot(prepared)
        self._topics[name] = RobotTopics(self.bus, self.clock, self._robot, tells_time=True)
        self._inside = assembly.what_it_is_inside(prepared.plan)
        self.diagnostics: tuple[Diagnostic, ...] = (
            *world.diagnostics,
            *prepared.findings,
            *assembly.diagnostics,
            *_starts_inside(world, name, self._inside),
        )
        """The warnings that building it gave."""

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
        prepared = prepare(robot, naming, PlanarPose(x, y, yaw), None, self.contacts)
        self._use(self._engine.assembly.with_robot(prepared.plan))
        simulated = self._add_robot(prepared)
        self.diagnostics = (*self.diagnostics, *prepared.findings)
        self._restart(simulated)
        if simulated._is_slewing:
            self._serve(simulated)
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
        self._disturbances.forget(name)
        self._use(self._engine.assembly.without_robot(name))
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
        share = self._lost_commands if watchdog is not None else 0.0
        # what is lost is journalled too: when the run is done again it is drawn for again
        is_lost = share > 0.0 and self._random.random() < share
        if not is_lost and robot._obey(linear, angular, deadline):
            self._serve(robot)
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
        commanded = self.named(robot)
        commanded._command_joints(told, kind)
        self._serve(commanded)
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
        commanded = self.named(robot)
        commanded._follow(names, way, self._steps)
        self._serve(commanded)
        self._note("follow_trajectory", joints=list(names), points=[list(p) for p in way], robot=robot)

    def _add_robot(self, prepared: Prepared) -> SimulatedRobot:
        """Have a robot that stands in the engine already."""
        robot = SimulatedRobot(prepared, self, self._engine, self.timestep)
        self.robots[robot.name] = robot
        return robot

    def _use(self, assembly: Assembly) -> None:
        """Go on with another assembly of the engine's model, in which all acts that acted in the last."""
        self._engine.use(assembly)
        for robot in self.robots.values():
            robot._bind()
        self._disturbances.begin_again()

    def _body_called(self, link: str, robot: str | None) -> str:
        """The engine's name of a robot's link, or where no robot is named also of a body of the world."""
        if not isinstance(link, str):
            raise KbotError(f"a link or a body is spoken of by its name, not {shortened(link)}")
        owner = self.named(robot)
        if robot is None and link not in owner.links:
            for body in self.world.bodies:
                if body.name == link:
                    return STANDING if body.is_static else PREFIX + body.name
            hint = did_you_mean(link, (*owner.links, *(body.name for body in self.world.bodies)))
            told = f"'{owner.name}' has no link, and the world no body, {shortened(link)}"
            raise KbotError(told + (f": {hint}" if hint else ""))
        owner.body(link)
        return owner.prefix + link

    @staticmethod
    def _restart(robot: SimulatedRobot) -> None:
        """Its joints at 0, or at the end of a range that leaves it out which is nearest, and without
        commands."""
        for joint in robot.robot.movable_joints:
            if joint.name not in robot.held:
                robot._set_position(joint.name, rest(joint))
        robot._reset()


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
