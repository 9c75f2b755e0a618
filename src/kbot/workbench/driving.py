"""The simulation as the page moves it: paced by wall time, driven by commands."""

from __future__ import annotations

import dataclasses
import time
from collections.abc import Callable
from dataclasses import dataclass
from typing import Literal, TypeAlias

from kbot.kinematics.differential_drive import NoDrive, find_drive
from kbot.model import Robot
from kbot.sim import Simulation
from kbot.text import KbotError
from kbot.workbench.lidars import Lidars
from kbot.workbench.motion import Moment, flat
from kbot.workbench.protocol import Scan
from kbot.workbench.session import Reader, Session
from kbot.world import BUILDERS, World, load_world

BUSY_SECONDS = 0.03
"""The longest that one call steps, in wall time, so that the server keeps answering."""
STEPS_AT_ONCE = 20

Attend: TypeAlias = Callable[[Simulation], None]
"""Told of each simulation before it first moves: the first one, and those that take its place."""


def driven_session(
    reader: Reader, world: str, seed: int, contacts: str, attend: Attend = lambda simulation: None
) -> Session:
    """A session whose robot is simulated.

    Raises:
        DescriptionError: it makes no robot, or one that cannot be simulated.
        KbotError: there is no such world.
    """
    setup = _Setup(load_world(world), seed, contacts, attend)
    return Session(
        reader, "sim", lambda robot: Driving(robot, setup), setup.world, why_not, limits, tuple(BUILDERS)
    )


def why_not(robot: Robot) -> str:
    """Why a robot cannot drive, empty when it can."""
    drive = find_drive(robot)
    return drive.reason if isinstance(drive, NoDrive) else ""


def limits(robot: Robot) -> tuple[float, float]:
    """Forward m/s and turning rad/s for full: brisk for the robot's size, and 1 m/s at most."""
    drive = find_drive(robot)
    if isinstance(drive, NoDrive):
        return 0.0, 0.0
    linear = min(1.0, 14.0 * drive.radius)
    return round(linear, 2), round(min(4.0, linear / drive.separation), 2)


@dataclass(frozen=True, slots=True)
class _Setup:
    """What stays when the robot changes."""

    world: World
    seed: int
    contacts: str
    attend: Attend


class Driving:
    """A running simulation."""

    def __init__(self, robot: Robot, setup: _Setup, simulation: Simulation | None = None) -> None:
        """Starts a simulation, or goes on with one.

        Raises:
            DescriptionError: the robot cannot be simulated.
        """
        self._setup = setup
        self._sim = simulation or Simulation(robot, setup.world, setup.seed, contacts=setup.contacts)
        self._command = (0.0, 0.0)
        self._owed = 0.0
        self._lidars = Lidars(self._sim)
        setup.attend(self._sim)

    def moment(self) -> Moment:
        sim = self._sim
        pose, twist = sim.odometry.pose, sim.odometry.twist
        return Moment(
            time=sim.time,
            positions=sim.joint_positions,
            poses=sim.link_poses(),
            bodies=flat(sim.body_poses().values()),
            command=self._command,
            twist=(twist.x, twist.yaw),
            odometry=(pose.x, pose.y, pose.yaw),
        )

    def scans(self) -> list[Scan]:
        return self._lidars.news()

    def advance(self, seconds: float) -> float:
        step = self._sim.timestep
        self._owed += seconds
        start, before = time.monotonic(), self._sim.time
        while self._owed >= step:
            count = min(STEPS_AT_ONCE, int(self._owed / step))
            self._sim.step(count)
            self._owed -= count * step
            if time.monotonic() - start > BUSY_SECONDS:
                self._owed = 0.0  # the machine cannot follow: simulated time falls behind
        return self._sim.time - before

    def reset(self) -> None:
        self._sim.reset()
        self._command, self._owed = (0.0, 0.0), 0.0

    def drive(self, linear: float, angular: float) -> None:
        self._sim.cmd_vel(linear, angular)
        self._command = (linear, angular)

    def push(self, link: str, force: tuple[float, float, float], seconds: float) -> None:
        self._sim.apply_body_wrench(link, force, seconds)

    def set_joint(self, name: str, position: float) -> None:
        raise KbotError("joints follow the simulation here: kbot view sets them by hand")

    def set_joints(self, preset: Literal["zero", "centre", "random"]) -> None:
        raise KbotError("joints follow the simulation here: kbot view sets them by hand")

    def replace(self, robot: Robot) -> Driving:
        """Go on with the changed robot where this one stands."""
        other = Driving(robot, self._setup, self._sim.with_robot(robot))
        other._command = self._command
        return other

    def enter(self, world: str) -> tuple[Driving, World]:
        """The robot at the start of another world."""
        setup = dataclasses.replace(self._setup, world=load_world(world))
        return Driving(self._sim.robot, setup), setup.world
