"""Runs a simulation until its robot has reached a goal on a map."""

from __future__ import annotations

from dataclasses import replace

from kbot.kinematics.planar_pose import PlanarPose
from kbot.navigation.goal_checks import require_goal
from kbot.navigation.goal_status import GoalReport
from kbot.navigation.simulated.lidars import LidarPoints
from kbot.navigation.simulated.mobility import mobility
from kbot.navigation.simulated.pilot import RATE, Pilot, PoseSource
from kbot.navigation.simulated.trip import Trip, run_trip
from kbot.navigation.with_map.navigator import DEFAULTS, Navigator, NavigatorSettings
from kbot.navigation.with_map.robot_planner import robot_planner
from kbot.sensors.lidar import LidarSensor
from kbot.sim import Simulation
from kbot.world.occupancy import OccupancyGrid


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
    driver, accepted, first_path = navigator, navigator.go(goal, timeout, any_heading), 0.0
    seen = LidarPoints(lidar) if lidar is not None else None
    pilot = Pilot(simulation, driver, pose=pose, seen=seen)

    def report() -> GoalReport:
        nonlocal first_path
        if first_path == 0.0 and driver.path is not None:
            first_path = driver.path.length
        return driver.status or accepted

    trip = run_trip(
        simulation,
        goal,
        driver.settings.limits.distance,
        RATE,
        report,
        lambda: pilot.estimate.pose,
        pilot.close,
    )
    return replace(trip, shortest=first_path, map="given")
