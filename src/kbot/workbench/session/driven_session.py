"""A session with a simulated robot."""

from __future__ import annotations

from functools import partial

from kbot.kinematics.drive.drive import NoDrive, find_drive
from kbot.kinematics.planar_pose import PlanarPose
from kbot.model import RobotModel
from kbot.sim.naming import ROOT_NAMING, Naming
from kbot.sim.simulation import ORIGIN
from kbot.workbench.driving.driving import Attend, Driving, RunSetup
from kbot.workbench.driving.world_actions import SPAWNED
from kbot.workbench.protocol import WorldChoice, WorldParameter
from kbot.workbench.session.offers import Offers
from kbot.workbench.session.session import Session
from kbot.workbench.source.shown import Reader
from kbot.world import BUILDERS, World, built_in
from kbot.world.builtin.registry import parameters


def driven_session(
    reader: Reader,
    world: World,
    named: str,
    seed: int,
    contacts: str,
    attend: Attend = lambda simulation: None,
    start: PlanarPose = ORIGIN,
    naming: Naming = ROOT_NAMING,
) -> Session:
    """A session whose robot is simulated, and starts at `start` in the world, which `named` names; `naming`
    says where its topics are.

    Raises:
        DescriptionError: it makes no robot, or one that cannot be simulated.
    """
    setup = RunSetup(world, named, named, seed, contacts, attend, start, naming)
    return Session(
        reader,
        "sim",
        lambda robot: Driving(robot, setup),
        world,
        Offers(why_not, limits, partial(world_choices, named), named, SPAWNED),
    )


def world_choices(first: str, named: str) -> tuple[WorldChoice, ...]:
    """The built-in worlds, and that of the start where it is a file; `named` is the present one, as in
    `boxes:count=20`."""
    present = built_in(named)
    files = () if built_in(first) else (WorldChoice(first, ()),)
    return files + tuple(
        WorldChoice(
            name,
            tuple(
                WorldParameter(key, float(value), isinstance(value, int))
                for key, value in parameters(named if name == present else name).items()
            ),
        )
        for name in BUILDERS
    )


def why_not(robot: RobotModel) -> str:
    """Why a robot cannot drive, empty when it can."""
    drive = find_drive(robot)
    return drive.reason if isinstance(drive, NoDrive) else ""


def limits(robot: RobotModel) -> tuple[float, float]:
    """Forward m/s and turning rad/s for full: brisk for the robot's size, and 1 m/s at most."""
    drive = find_drive(robot)
    if isinstance(drive, NoDrive):
        return 0.0, 0.0
    linear = min(1.0, 14.0 * drive.radius)
    return round(linear, 2), round(min(4.0, linear / drive.separation), 2)
