"""What a policy of a simulated robot sees and commands, from the robot's drive and its declared lidar."""

from __future__ import annotations

import math

from kbot.kinematics.drive.drive import NoDrive
from kbot.learn.interface.policy_interface import PolicyInterface, Sectors
from kbot.navigation.controller import GENTLE
from kbot.navigation.lidar_view import LidarView
from kbot.navigation.simulated.lidars import level_lidar, lidar_view
from kbot.navigation.simulated.motion_limits import motion_limits
from kbot.sim import Simulation
from kbot.sim.robot import SimulatedRobot
from kbot.text import KbotError

SECTORS = 36
"""The default number of directions in which a policy sees obstacles: one for each 10 degrees."""
REACH = 5.0
"""m. The furthest obstacle that a policy sees by default. Within it, a robot at 2 m/s brakes easily."""


def policy_interface(
    simulation: Simulation,
    target: str,
    *,
    sectors: int | None = None,
    reach: float = REACH,
    max_speed: tuple[float, float] | None = None,
    reverse: bool = False,
    rate: float = 10.0,
) -> PolicyInterface:
    """What a policy of the simulation's first robot sees and commands.

    Args:
        simulation: its robot's lidar is mounted.
        target: `goal` or `path`.
        sectors: directions in which the policy sees obstacles; 0 for none; by default `SECTORS` for a robot
            that declares a lidar, and 0 for others.
        reach: m. The furthest obstacle that the policy sees.
        max_speed: m/s and rad/s, by default the limits that the robot declares.
        reverse: whether the policy can drive backwards.
        rate: commands per second.

    Raises:
        KbotError: the robot cannot drive, has no level lidar for the sectors, or a number is not valid.
    """
    robot = simulation.robots.first
    if isinstance(robot.drive, NoDrive):
        raise KbotError(f"robot '{robot.name}' cannot drive: {robot.drive.reason}")
    lidar = None if sectors == 0 else level_lidar(simulation)
    if sectors and lidar is None:
        raise KbotError(
            f"robot '{robot.name}' declares no level lidar with one row of beams, which the policy's lidar"
            " sectors need. Add a lidar to the description, or set the number of sectors to 0"
        )
    limits = motion_limits(robot, max_speed)
    sideways = None
    if robot.drives_sideways:
        fastest = _lateral(robot)
        sideways = -min(fastest, limits.linear), min(fastest, limits.linear)
    return PolicyInterface(
        target,
        linear=(-limits.linear if reverse else 0.0, limits.linear),
        angular=(-limits.angular, limits.angular),
        lateral=sideways,
        lidar=None
        if lidar is None
        else _sectors(SECTORS if sectors is None else sectors, reach, lidar_view(lidar)),
        rate=rate,
    )


def _lateral(robot: SimulatedRobot) -> float:
    fastest = math.inf if robot.wheels is None else robot.wheels.fastest[1]
    return GENTLE.linear if math.isinf(fastest) else fastest


def _sectors(count: int, reach: float, view: LidarView) -> Sectors:
    return Sectors(count, view.start, view.end, min(reach, view.reach))
