"""The simulation as the page moves it: paced by wall time, driven by commands."""

from __future__ import annotations

import time
from typing import Literal

from kbot.kinematics.differential_drive import NoDrive, find_drive
from kbot.model import Robot
from kbot.sim import Simulation
from kbot.text import KbotError
from kbot.workbench.motion import Moment
from kbot.workbench.session import Reader, Session
from kbot.world import World, load_world

BUSY_SECONDS = 0.05
"""The longest that one call steps, in wall time, so that the server keeps answering."""
STEPS_AT_ONCE = 20


def driven_session(reader: Reader, world: str, seed: int, contacts: str) -> Session:
    """A session whose robot is simulated.

    Raises:
        DescriptionError: it makes no robot, or one that cannot be simulated.
        KbotError: there is no such world.
    """
    place = load_world(world)
    return Session(
        reader,
        "sim",
        lambda robot: Driving(robot, place, seed, contacts),
        place,
        why_not,
        limits,
    )


def why_not(robot: Robot) -> str:
    """Why a robot cannot drive, empty when it can."""
    drive = find_drive(robot)
    return drive.reason if isinstance(drive, NoDrive) else ""


def limits(robot: Robot) -> tuple[float, float]:
    """Forward m/s and turning rad/s for a held key: brisk, and within what the wheels may turn."""
    drive = find_drive(robot)
    if isinstance(drive, NoDrive):
        return 0.0, 0.0
    linear = min(1.0, 8.0 * drive.radius)
    return round(linear, 2), round(min(2.5, 1.2 * linear / drive.separation), 2)


class Driving:
    """A running simulation."""

    def __init__(self, robot: Robot, world: World, seed: int, contacts: str) -> None:
        self._world, self._seed, self._contacts = world, seed, contacts
        self._sim = Simulation(robot, world=world, seed=seed, contacts=contacts)
        self._command = (0.0, 0.0)
        self._owed = 0.0

    def moment(self) -> Moment:
        sim = self._sim
        odometry = sim.odometry
        return Moment(
            time=sim.time,
            positions=sim.joint_positions,
            poses=sim.link_poses(),
            command=self._command,
            twist=(odometry.twist.linear, odometry.twist.angular),
            odometry=(odometry.pose.x, odometry.pose.y, odometry.pose.yaw),
        )

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
        self._command = (0.0, 0.0)
        self._owed = 0.0

    def drive(self, linear: float, angular: float) -> None:
        self._sim.cmd_vel(linear, angular)
        self._command = (linear, angular)

    def set_joint(self, name: str, position: float) -> None:
        raise KbotError("joints follow the simulation here: kbot view sets them by hand")

    def set_joints(self, preset: Literal["zero", "centre", "random"]) -> None:
        self.set_joint("", 0.0)

    def replace(self, robot: Robot) -> Driving:
        raise NotImplementedError
