"""Runs navigation controllers and goals in a simulation."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from kbot.kinematics.drive.drive import DifferentialDrive, NoDrive, SteeredDrive
from kbot.kinematics.planar_pose import PlanarPose
from kbot.navigation.controller import Controller, Observation, wrapped
from kbot.navigation.footprint import height, outline, turning_radius
from kbot.navigation.goal_status import GoalReport, GoalState
from kbot.navigation.navigator import DEFAULTS, Navigator, NavigatorSettings, require_goal
from kbot.navigation.planner import GridPlanner
from kbot.sensors.collisions import CollisionWatch
from kbot.sensors.declared import mount_declared
from kbot.sensors.lidar import LidarSensor, scan_points
from kbot.sim import Simulation
from kbot.text import KbotError
from kbot.world.occupancy import OccupancyGrid
from kbot.world.occupancy_of_world import HEIGHTS, world_grid

RATE = 50.0
"""Updates of a controller a second."""

PoseSource = Literal["ground_truth", "odometry"]
Seen = Callable[[], tuple[NDArray[np.float64] | None, float]]


MARGIN = 2.0
"""Free ground on a robot's map around all that stands in its world; metres."""
MOST_CELLS = 2_000_000
"""Of a robot's map: what a planner makes tables of in a second."""
FINE = 0.005
MOST_FINE_CELLS = 4_000_000
"""Metres a cell, and how many, where a way is too narrow for the usual ones."""
LEVEL = math.cos(math.radians(5.0))
STANDS = math.cos(math.radians(60.0))
"""Upward part of the root link's z axis below which a robot lies: no ramp that is driven is as steep."""


def robot_planner(simulation: Simulation, around: Sequence[tuple[float, float]]) -> GridPlanner:
    """Plans over what stands in the way of a simulation's robot, as far as the points `around` (m) and some
    way beyond; where that shows no way, over a map of finer cells.

    Raises:
        KbotError: the robot cannot drive, steers or has no size, or the world is too large for a map.
    """
    base = require_turning(simulation).base
    low, high = HEIGHTS
    robot, world = simulation.robot, simulation.world
    heights = low, max(high, height(robot, base))
    grid = world_grid(world, heights=heights, around=around, margin=MARGIN, most_cells=MOST_CELLS)

    def finer() -> OccupancyGrid:
        return world_grid(world, FINE, heights, around, most_cells=MOST_FINE_CELLS)

    return GridPlanner(grid, turning_radius(robot, base), finer=finer)


def require_turning(simulation: Simulation) -> DifferentialDrive:
    """The drive of a robot that can follow a path.

    Raises:
        KbotError: the robot does not drive; it steers, and paths have corners at which a robot turns on the
            spot; or it does not move as it is commanded.
    """
    drive, name = simulation.robots.first.drive, simulation.robots.first.name
    if isinstance(drive, NoDrive):
        raise KbotError(f"robot '{name}' cannot drive: {drive.reason}")
    if isinstance(drive, SteeredDrive):
        raise KbotError(f"robot '{name}' steers: goals are planned for robots that turn on the spot")
    if drive.mistakes:
        raise KbotError(f"robot '{name}' cannot follow a path: {next(iter(drive.mistakes.values()))}")
    return drive


def level_lidar(simulation: Simulation) -> LidarSensor | None:
    """The first lidar that the description declares whose beams are level; None where there is none."""
    sensors, _ = mount_declared(simulation, strict=False)
    for sensor in sensors.values():
        if isinstance(sensor, LidarSensor) and sensor.owner == simulation.robots.first.name:
            up = (simulation.link_pose(sensor.spec.link) @ sensor.spec.pose).rotation[2, 2]
            base_up = simulation.link_pose(simulation.robot.root).rotation[2, 2]
            if abs(up) >= LEVEL * abs(base_up):
                return sensor
    return None


def lies(simulation: Simulation) -> str:
    """How the robot lies, and what is to be done, where it does not stand on its wheels; else empty."""
    pose = simulation.link_pose(simulation.robot.root)
    up = float(pose.rotation[2, 2])
    if up >= STANDS:
        return ""
    roll, pitch, _ = (round(math.degrees(angle)) for angle in pose.rpy)
    where = "back" if up < -STANDS else "side"
    return (
        f"the robot lies on its {where} (roll {roll}°, pitch {pitch}°): reset the simulation, or put "
        "the robot somewhere (a pose estimate does it), which sets it upright"
    )


class LidarPoints:
    """What a lidar saw last, as points in the frame of its robot's base, and when."""

    def __init__(self, lidar: LidarSensor) -> None:
        """The lidar hangs rigidly on the base."""
        self._lidar = lidar
        simulation, spec = lidar.simulation, lidar.spec
        drive = simulation.robots.first.drive
        base = drive.base if isinstance(drive, DifferentialDrive) else simulation.robot.root
        base_from_link = simulation.link_pose(base).inverse() @ simulation.link_pose(spec.link)
        self._base_from_sensor = (base_from_link @ spec.pose).matrix
        self._points: NDArray[np.float64] | None = None
        self._seen_at = -math.inf

    def __call__(self) -> tuple[NDArray[np.float64] | None, float]:
        scan = self._lidar.latest
        if scan is None:
            return None, -math.inf
        if scan.header.stamp.seconds != self._seen_at:
            self._points = scan_points(scan, self._base_from_sensor)
            self._seen_at = scan.header.stamp.seconds
        return self._points, self._seen_at


class Pilot:
    """Lets a controller drive a simulation's robot, until it is closed.

    The pose it tells is the ground truth, standing for a perfect localisation, or what the wheels tell from
    `start` on.
    """

    def __init__(
        self,
        simulation: Simulation,
        controller: Controller,
        rate: float = RATE,
        pose: PoseSource = "ground_truth",
        seen: Seen | None = None,
    ) -> None:
        """`seen` gives the obstacles and the time they were seen, as `LidarPoints` does."""
        if pose not in ("ground_truth", "odometry"):
            raise KbotError(f"a pose comes from ground_truth or odometry, not '{pose}'")
        self._simulation, self._controller, self._source, self._seen = simulation, controller, pose, seen
        self.start = simulation.ground_truth.pose @ simulation.odometry.pose.inverse()
        self._timer = simulation.clock.every(rate, self.tick)

    def observe(self) -> Observation:
        sim = self._simulation
        points, seen_at = self._seen() if self._seen else (None, -math.inf)
        if self._source == "ground_truth":
            motion = sim.ground_truth
            pose = motion.pose
        else:
            motion = sim.odometry
            pose = self.start @ motion.pose
        return Observation(sim.time, pose, motion.twist, points, sim.time - seen_at, lies(sim))

    def tick(self) -> None:
        """Ask the controller once and command what it says."""
        wanted = self._controller.update(self.observe())
        self._simulation.cmd_vel(wanted.linear.x, wanted.angular.z)

    def close(self) -> None:
        """Drive no more; the robot keeps its last command."""
        self._timer.cancel()


@dataclass(frozen=True, slots=True)
class Trip:
    """How a goal ended. `pose` is the true one, `odometry_error` how far odometry was off it then;
    `distance` the way driven, `shortest` the planned path's length; m, s. `collided`: whether the robot
    touched anything but the ground, as `CollisionWatch` defines it."""

    status: GoalReport
    time: float
    distance: float
    shortest: float
    pose: PlanarPose
    odometry_error: float
    collided: bool

    @property
    def off(self) -> float:
        """m that the robot truly stands from the goal."""
        goal = self.status.goal
        return math.hypot(goal.x - self.pose.x, goal.y - self.pose.y)

    @property
    def turned_off(self) -> float:
        """rad between its true heading and the goal's, at most half a turn."""
        return abs(wrapped(self.status.goal.yaw - self.pose.yaw))

    @property
    def reached(self) -> bool:
        return self.status.state is GoalState.REACHED


def go_to(
    simulation: Simulation,
    goal: PlanarPose,
    grid: OccupancyGrid | None = None,
    timeout: float | None = None,
    settings: NavigatorSettings = DEFAULTS,
    pose: PoseSource = "ground_truth",
    navigator: Navigator | None = None,
    lidar: LidarSensor | None = None,
) -> Trip:
    """Run the simulation until its robot is at the goal or cannot get there; it stands still at the end.

    `grid` is the map, by default that of the simulation's world. A `navigator` brings its own. With a `lidar`
    the robot stops before what it sees and plans around it.

    Raises:
        KbotError: the robot cannot drive, a number is not one, or the goal further off than anything goes.
    """
    require_goal(goal)
    if navigator is None:
        here = simulation.ground_truth.pose
        around = (here.x, here.y), (goal.x, goal.y)
        robot, base = simulation.robot, require_turning(simulation).base
        if grid is None:
            planner = robot_planner(simulation, around)
        else:
            planner = GridPlanner(grid, turning_radius(robot, base))
        navigator = Navigator(planner, settings)
        if lidar is not None:
            navigator.watch_out(outline(robot, base), lidar.spec.rate)
    begun = simulation.time
    status = navigator.go(goal, timeout)
    odometer = _Odometer(simulation)
    seen = LidarPoints(lidar) if lidar is not None else None
    pilot = Pilot(simulation, navigator, pose=pose, seen=seen)
    collisions = CollisionWatch(simulation)
    first_path = 0.0
    try:
        while not status.state.is_end:
            simulation.run(1.0 / RATE)
            status = navigator.status or status
            odometer.sample()
            if first_path == 0.0 and navigator.path is not None:
                first_path = navigator.path.length
        took = simulation.time - begun
        simulation.cmd_vel(0.0, 0.0)
        simulation.run(0.5)
    finally:
        pilot.close()
        collisions.close()
    odometer.sample()
    true = simulation.ground_truth.pose
    told = pilot.start @ simulation.odometry.pose
    error = math.hypot(true.x - told.x, true.y - told.y)
    return Trip(status, took, odometer.distance, first_path, true, error, collisions.collided)


class _Odometer:
    """Adds up the way that the base truly goes."""

    def __init__(self, simulation: Simulation) -> None:
        self._simulation = simulation
        self._last = simulation.ground_truth.pose
        self.distance = 0.0

    def sample(self) -> None:
        pose = self._simulation.ground_truth.pose
        self.distance += math.hypot(pose.x - self._last.x, pose.y - self._last.y)
        self._last = pose
