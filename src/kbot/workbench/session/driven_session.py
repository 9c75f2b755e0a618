"""A session with a simulated robot."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial

from kbot.kinematics.drive.drive import NoDrive, find_drive
from kbot.kinematics.planar_pose import PlanarPose
from kbot.model import RobotModel
from kbot.navigation import Goals
from kbot.sim import Simulation
from kbot.sim.naming import ROOT_NAMING, Naming
from kbot.workbench.driving.driving import Driving, OnStart, RunSetup, goals_on_map
from kbot.workbench.driving.world_actions import SPAWNABLE
from kbot.workbench.protocol import WorldChoice, WorldParameter
from kbot.workbench.session.offers import Offers
from kbot.workbench.session.session import Session
from kbot.workbench.source.shown import Reader
from kbot.world import BUILDERS, World, built_in
from kbot.world.builtin.registry import parameters


def driven_session(
    reader: Reader,
    world: World,
    world_name: str,
    seed: int,
    contacts: str,
    on_start: OnStart = lambda simulation: None,
    start: PlanarPose | None = None,
    naming: Naming = ROOT_NAMING,
    make_goals: Callable[[Simulation], Goals] = goals_on_map,
    goal: PlanarPose | None = None,
    goal_has_heading: bool = False,
) -> Session:
    """Return a session whose robot is simulated in the world that `world_name` names.

    `start` is that of `Simulation`, and `naming` sets the namespace of its topics. The simulation starts
    once the description is usable. `make_goals` makes what drives to goals, and `goal` is the first one.
    Its yaw counts if `goal_has_heading`.
    """
    setup = RunSetup(
        world,
        world_name,
        world_name,
        seed,
        contacts,
        on_start,
        start,
        naming,
        make_goals,
        goal,
        goal_has_heading,
    )
    return Session(
        reader,
        "sim",
        lambda robot: Driving(robot, setup),
        world,
        Offers(reason_not_driving, limits, partial(world_choices, world_name), world_name, SPAWNABLE),
    )


def world_choices(first: str, world_name: str) -> tuple[WorldChoice, ...]:
    """Return the built-in worlds, preceded by the first world if it is a file.

    `first` names the world of the start and `world_name` the current one, for example `boxes:count=20`.
    """
    present = built_in(world_name)
    files = () if built_in(first) else (WorldChoice(first, ()),)
    return files + tuple(
        WorldChoice(
            name,
            tuple(
                WorldParameter(key, float(value), isinstance(value, int))
                for key, value in parameters(world_name if name == present else name).items()
            ),
        )
        for name in BUILDERS
    )


def reason_not_driving(robot: RobotModel) -> str:
    """Return why a robot cannot drive, or an empty string."""
    drive = find_drive(robot)
    return drive.reason if isinstance(drive, NoDrive) else ""


def limits(robot: RobotModel) -> tuple[float, float]:
    """Return m/s forward and rad/s turning at full speed: brisk for the robot's size, and 1 m/s at most."""
    drive = find_drive(robot)
    if isinstance(drive, NoDrive):
        return 0.0, 0.0
    linear = min(1.0, 14.0 * drive.radius)
    return round(linear, 2), round(min(4.0, linear / drive.separation), 2)
