"""Runs navigation controllers and goals in a simulation: `Pilot`, `go_to` and `Trip`."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from kbot.kinematics.drive.drive import DifferentialDrive
from kbot.kinematics.planar_pose import PlanarPose
from kbot.messages.sensing import LaserScan
from kbot.navigation.arrival_watch import ArrivalWatch
from kbot.navigation.collision_watch import CollisionWatch
from kbot.navigation.controller import Controller, Observation, wrapped
from kbot.navigation.goal_status import GoalReport, GoalState
from kbot.navigation.mobility import BaseKind, Mobility, mobility
from kbot.navigation.navigator import DEFAULTS, Navigator, NavigatorSettings, require_goal
from kbot.navigation.planner import Planner
from kbot.navigation.simulated_shape import world_without_loads
from kbot.sensors.declared import mount_declared
from kbot.sensors.lidar import LidarSensor, scan_points
from kbot.sim import Simulation
from kbot.sim.motion_watch import UPRIGHT
from kbot.sim.report import Odometer
from kbot.text import KbotError
from kbot.world.occupancy import OccupancyGrid
from kbot.world.occupancy_of_world import HEIGHTS, world_grid

RATE = 50.0
"""Updates of a controller per second."""

PoseSource = Literal["ground_truth", "odometry"]
Seen = Callable[[], tuple[NDArray[np.float64] | None, float]]
"""Returns the obstacles, and the time at which they were detected."""

MARGIN = 2.0
"""Free ground in m on the map around all objects of the world."""
MOST_CELLS = 2_000_000
"""Cells of a map. A planner makes the tables of so many in a second."""
FINE = 0.005
MOST_FINE_CELLS = 4_000_000
"""Size of a cell in m, and number of cells, of the map for narrow ways."""
LEVEL = math.cos(math.radians(5.0))
"""Cosine of the angle by which a lidar may be tilted to count as level."""


def robot_planner(
    simulation: Simulation, around: Sequence[tuple[float, float]], moves: Mobility | None = None
) -> Planner:
    """A planner on the map of a simulation's world, which reaches `MARGIN` beyond the points `around` (m). If
    the map shows no way, the planner uses a map with smaller cells.

    `moves` is how the robot moves now, if it is known. What the robot carries is not on the map.

    Raises:
        KbotError: the robot cannot drive or has no size, or the world is too large for a map.
    """
    moves = moves or mobility(simulation)
    low, high = HEIGHTS
    world = world_without_loads(simulation)
    heights = low, max(high, moves.shape.height)
    room = moves.shape.radius + (2.0 * moves.steering.radius if moves.steering is not None else 0.0)
    margin = MARGIN if moves.kind is BaseKind.TURNS else max(MARGIN, room)
    grid = world_grid(world, heights=heights, around=around, margin=margin, most_cells=MOST_CELLS)

    def finer() -> OccupancyGrid:
        return world_grid(world, FINE, heights, around, most_cells=MOST_FINE_CELLS)

    return moves.planner(grid, finer)


def level_lidars(simulation: Simulation) -> list[LidarSensor]:
    """The level lidars with one row of beams that the description declares, mounted."""
    sensors, _ = mount_declared(simulation, strict=False)
    found = []
    for sensor in sensors.values():
        if isinstance(sensor, LidarSensor) and sensor.owner == simulation.robots.first.name:
            up = (simulation.link_pose(sensor.spec.link) @ sensor.spec.pose).rotation[2, 2]
            base_up = simulation.link_pose(simulation.robot.root).rotation[2, 2]
            if abs(up) >= LEVEL * abs(base_up):
                found.append(sensor)
    return found


def level_lidar(simulation: Simulation) -> LidarSensor | None:
    """The first level lidar that the description declares, mounted; None if there is none."""
    return next(iter(level_lidars(simulation)), None)


def describe_fall(simulation: Simulation) -> str:
    """How the robot lies if it has fallen over, and what to do; empty for a robot on its wheels."""
    pose = simulation.link_pose(simulation.robot.root)
    up = float(pose.rotation[2, 2])
    if up >= UPRIGHT:
        return ""
    roll, pitch, _ = (round(math.degrees(angle)) for angle in pose.rpy)
    where = "back" if up < -UPRIGHT else "side"
    return (
        f"the robot lies on its {where} (roll {roll}°, pitch {pitch}°): reset the simulation, or place the "
        "robot upright, for example with a pose estimate"
    )


def base_from_lidar(lidar: LidarSensor) -> NDArray[np.float64]:
    """The pose (4, 4) of a lidar in the frame of its robot's base, on which it must be mounted rigidly."""
    simulation, spec = lidar.simulation, lidar.spec
    drive = simulation.robots.first.drive
    base = drive.base if isinstance(drive, DifferentialDrive) else simulation.robot.root
    base_from_link = simulation.link_pose(base).inverse() @ simulation.link_pose(spec.link)
    pose: NDArray[np.float64] = (base_from_link @ spec.pose).matrix
    return pose


class LidarPoints:
    """Returns the points of a lidar's last scan, in the frame of its robot's base, and the scan's time."""

    def __init__(self, lidar: LidarSensor) -> None:
        """The lidar must be mounted rigidly on the base."""
        self._lidar = lidar
        self._base_from_sensor = base_from_lidar(lidar)
        self._points: NDArray[np.float64] | None = None
        self._scan: LaserScan | None = None

    def __call__(self) -> tuple[NDArray[np.float64] | None, float]:
        scan = self._lidar.latest
        if scan is None:
            return None, -math.inf
        if scan is not self._scan:  # after a reset, scans have the same stamps again
            self._points, self._scan = scan_points(scan, self._base_from_sensor), scan
        return self._points, scan.header.stamp.seconds


class Pilot:
    """Lets a controller drive a simulation's robot until it is closed.

    The controller gets the true pose, as from a perfect localisation, or the pose from odometry since
    `start`."""

    def __init__(
        self,
        simulation: Simulation,
        controller: Controller,
        rate: float = RATE,
        pose: PoseSource = "ground_truth",
        seen: Seen | None = None,
    ) -> None:
        """`seen` returns the obstacles and the time at which they were detected, as `LidarPoints` does."""
        if pose not in ("ground_truth", "odometry"):
            raise KbotError(f"pose must be 'ground_truth' or 'odometry', not '{pose}'")
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
        return Observation(sim.time, pose, motion.twist, points, sim.time - seen_at, describe_fall(sim))

    def tick(self) -> None:
        """Update the controller once and command its twist."""
        wanted = self._controller.update(self.observe())
        self._simulation.cmd_vel(wanted.linear.x, wanted.angular.z, wanted.linear.y)

    def close(self) -> None:
        """Stop calling the controller. The robot keeps its last command."""
        self._timer.cancel()


@dataclass(frozen=True, slots=True)
class Trip:
    """How a goal ended; metres and seconds.

    status          the final state of the goal, with the reason
    time            that the goal took
    distance        that the robot drove
    shortest        length of the first planned path; without a map, of the straight line
    pose            the true pose at the end
    odometry_error  distance between the true position and that of odometry at the end
    collided        whether the robot touched anything but the ground, as `Collisions` defines it
    arrival         time from 0.1 m of movement until the true position was within the arrival radius; None if
                    it never was
    map             `given`, or `none` for a goal without a map
    """

    status: GoalReport
    time: float
    distance: float
    shortest: float
    pose: PlanarPose
    odometry_error: float
    collided: bool
    arrival: float | None = None
    map: Literal["given", "none"] = "given"

    @property
    def off(self) -> float:
        """The true distance from the goal in m."""
        goal = self.status.goal
        return math.hypot(goal.x - self.pose.x, goal.y - self.pose.y)

    @property
    def turned_off(self) -> float:
        """The true angle to the goal's heading in rad, at most pi."""
        return abs(wrapped(self.status.goal.yaw - self.pose.yaw))

    @property
    def state(self) -> GoalState:
        """The final state, which equals its text: `trip.state == "reached"`."""
        return self.status.state

    @property
    def reached(self) -> bool:
        return self.state is GoalState.REACHED


def go_to(
    simulation: Simulation,
    goal: PlanarPose,
    grid: OccupancyGrid | None = None,
    timeout: float | None = None,
    settings: NavigatorSettings = DEFAULTS,
    pose: PoseSource = "ground_truth",
    navigator: Navigator | None = None,
    lidar: LidarSensor | None = None,
    any_heading: bool = False,
) -> Trip:
    """Run the simulation until its robot has reached the goal or cannot reach it. The robot is then stopped.

    Args:
        simulation: whose first robot drives.
        goal: in the world's frame.
        grid: the map, by default that of the simulation's world.
        timeout: time limit in s, by default from the path's length.
        settings: limits for the goal.
        pose: which pose steers the robot.
        navigator: replaces the default one, with its own map.
        lidar: the robot stops before obstacles that it detects, and plans around them.
        any_heading: the goal's yaw does not matter.

    Raises:
        KbotError: the robot cannot drive, a number is not finite, or the goal is too far away.
    """
    require_goal(goal)
    if navigator is None:
        here = simulation.ground_truth.pose
        around = (here.x, here.y), (goal.x, goal.y)
        moves = mobility(simulation)
        planner = robot_planner(simulation, around, moves) if grid is None else moves.planner(grid)
        navigator = Navigator(planner, settings, guidance=moves.guidance)
        if lidar is not None:
            navigator.guard_with_lidar(moves.outline, lidar.spec.rate)
    begun = simulation.time
    status = navigator.go(goal, timeout, any_heading)
    odometer = Odometer(simulation)
    seen = LidarPoints(lidar) if lidar is not None else None
    pilot = Pilot(simulation, navigator, pose=pose, seen=seen)
    collisions = CollisionWatch(simulation)
    arrival = ArrivalWatch(simulation, goal, navigator.settings.limits.distance)
    first_path = 0.0
    try:
        while not status.state.is_end:
            simulation.run(1.0 / RATE)
            status = navigator.status or status
            if first_path == 0.0 and navigator.path is not None:
                first_path = navigator.path.length
        took = simulation.time - begun
        simulation.cmd_vel(0.0, 0.0)
        simulation.run(0.5)
    finally:
        pilot.close()
        collisions.close()
        arrival.close()
        odometer.close()
    true = simulation.ground_truth.pose
    odometry = pilot.start @ simulation.odometry.pose
    error = math.hypot(true.x - odometry.x, true.y - odometry.y)
    return Trip(status, took, odometer.distance, first_path, true, error, collisions.collided, arrival.time)
