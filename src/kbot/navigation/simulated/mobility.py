"""How a simulated robot's base moves, and the planner and the follower that suit it."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, replace
from enum import StrEnum

from kbot.kinematics.drive.drive import DifferentialDrive, HolonomicDrive, NoDrive, SteeredDrive
from kbot.kinematics.planar_pose import PlanarPose
from kbot.navigation.controller import ControllerLimits
from kbot.navigation.followers.holonomic_follower import HolonomicFollower
from kbot.navigation.followers.path_follower import Guidance, PathFollower
from kbot.navigation.followers.steered_follower import SteeredFollower, Steering
from kbot.navigation.path import Path
from kbot.navigation.planning.grid_planner import GridPlanner
from kbot.navigation.planning.planner import Planner
from kbot.navigation.planning.pose_planner import PosePlanner, holonomic, steered
from kbot.navigation.simulated.motion_limits import MotionLimits
from kbot.navigation.simulated.shape import simulated_shape
from kbot.navigation.space.footprint import Outline, RobotShape
from kbot.sim import Simulation
from kbot.text import KbotError
from kbot.world.occupancy import OccupancyGrid

RESERVE = 1.05
"""Paths have a turning radius that is this many times the least one, so that the base can still correct its
course in a curve."""
TURNING = 0.3
"""A base that drives sideways moves its furthest point by a metre when it turns by 1 / radius. This share of
it counts as length: enough to avoid turns without a use, too little for a detour."""
_ORIGIN = PlanarPose()


class BaseKind(StrEnum):
    """How a base moves: it turns on the spot, it drives curves as a car, or it drives in every direction.

    A tricycle whose wheel steers by 90 degrees turns on the spot, but has to steer first. It drives as a
    car."""

    TURNS = "turns"
    STEERS = "steers"
    SIDEWAYS = "sideways"


@dataclass(frozen=True, eq=False)
class Mobility:
    """What navigation needs to know about a base.

    base      its link
    shape     of the robot with its load, in the frame of the base
    point     the point that commands move, in the frame of the base: the middle of the axle of a base that
              steers or drives sideways
    steering  of a base with a least turning radius
    """

    kind: BaseKind
    base: str
    shape: RobotShape
    point: PlanarPose = _ORIGIN
    steering: Steering | None = None

    @property
    def outline(self) -> Outline:
        """The robot's outline in the frame of `point`."""
        return self.shape.outline.seen_from(self.point)

    @property
    def guidance(self) -> Guidance | None:
        """How a navigator guides the base; None for one that turns on the spot."""
        if self.kind is BaseKind.TURNS:
            return None
        return Guidance(self.point, self.follower)

    def planner(self, grid: OccupancyGrid, finer: Callable[[], OccupancyGrid] | None = None) -> Planner:
        """A planner for the base. `finer` makes a map with smaller cells, for narrow ways."""
        if self.kind is BaseKind.TURNS:
            return GridPlanner(grid, self.shape.radius, finer=finer)
        if self.steering is not None:
            return PosePlanner(grid, self.outline, steered(RESERVE * self.steering.radius, self.point))
        return PosePlanner(grid, self.outline, holonomic(TURNING * self.shape.radius))

    def with_limits(self, limits: MotionLimits) -> MotionLimits:
        """The limits of speed with those of this base's moves."""
        if self.kind is BaseKind.SIDEWAYS:
            return replace(limits, lateral=limits.linear)
        if self.steering is not None:
            curvature, time = 1.0 / self.steering.radius, self.steering.time
            return replace(limits, curvature=curvature, steering_time=time)
        return limits

    def follower(self, path: Path, limits: ControllerLimits) -> PathFollower:
        """The controller with which a base that does not turn on the spot follows a path with headings."""
        if self.steering is not None:
            return SteeredFollower(path, self.steering, limits)
        return HolonomicFollower(path, limits)


def mobility(simulation: Simulation) -> Mobility:
    """How a simulation's first robot moves, with its load as it is now.

    Raises:
        KbotError: the robot does not drive, does not move as commanded, or has no size.
    """
    robot = simulation.robots.first
    drive = robot.drive
    if isinstance(drive, NoDrive):
        raise KbotError(f"robot '{robot.name}' cannot drive: {drive.reason}")
    reason = why_no_goals(drive)
    if reason:
        raise KbotError(f"robot '{robot.name}' {reason}")
    shape = simulated_shape(simulation)
    if isinstance(drive, HolonomicDrive | SteeredDrive) and drive.sideways:
        return Mobility(BaseKind.SIDEWAYS, drive.base, shape, drive.axle_in_base_planar)
    if isinstance(drive, SteeredDrive):
        settings = robot.settings
        commanded = settings.with_controller_sizes(drive) if settings is not None else drive
        steering = _steering(commanded if isinstance(commanded, SteeredDrive) else drive)
        return Mobility(BaseKind.STEERS, drive.base, shape, drive.axle_in_base_planar, steering)
    return Mobility(BaseKind.TURNS, drive.base, shape)


def why_no_goals(drive: DifferentialDrive) -> str:
    """Why a robot with this drive cannot follow a path to a goal; empty if it can."""
    if isinstance(drive, SteeredDrive) and not drive.sideways and _curvature(drive) <= 0.0:
        return "cannot follow a path: its wheels do not steer to both sides"
    mistakes = list(drive.mistakes.values())
    return f"cannot follow a path: {mistakes[0]}" if mistakes else ""


def _curvature(drive: SteeredDrive) -> float:
    """The curvature (1/m) of the sharpest curve that the base drives to both sides.

    It is at most that of a front wheel that steers by 45 degrees: a path of sharper curves would only be
    driven slowly."""
    right, left = drive.curvatures
    return min(-right, left, 1.0 / drive.wheelbase)


def _steering(drive: SteeredDrive) -> Steering:
    curvature = _curvature(drive)
    times = [0.0]
    for module in drive.modules:
        if module.steering is not None and math.isfinite(module.rate):
            left, right = (module.steer(1.0, 0.0, side * curvature, 0.0) for side in (1.0, -1.0))
            times.append(abs(left - right) / module.rate)
    return Steering(1.0 / curvature, max(times) + 0.1)
