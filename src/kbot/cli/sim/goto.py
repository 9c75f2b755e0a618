"""`kbot sim --goto`: drive to a goal, with a map, without one or with a policy, then print a report."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

import click

from kbot.cli.output import print_json, report
from kbot.cli.sim.headless import ProgressLine

if TYPE_CHECKING:
    from kbot.kinematics import PlanarPose
    from kbot.learn.policies.policy import Policy
    from kbot.navigation import Trip
    from kbot.navigation.goals.goal_options import GoalOptions
    from kbot.sim import Simulation


@dataclass(frozen=True, slots=True)
class GotoRequest:
    """A goal, and how to drive to it.

    goal         in the world's frame
    has_heading  whether the goal's yaw counts
    options      of goals
    timeout      s, None for an estimate from the way
    policy       drives the robot, without a map; None for KBot's own controllers
    """

    goal: PlanarPose
    has_heading: bool
    options: GoalOptions
    timeout: float | None
    policy: Policy | None = None

    @property
    def has_map(self) -> bool:
        return not self.options.no_map and self.policy is None


def run_goto(simulation: Simulation, request: GotoRequest, as_json: bool) -> int:
    """Drive to the goal. Returns the exit status: 0 if it was reached, else 1."""
    from kbot.sensors.declared import mount_declared  # imported lazily, so that -h stays fast
    from kbot.sim.report import make_report

    # a goal needs none of them: what is wrong with one is reported, as in the page
    report(mount_declared(simulation, strict=False)[1])
    with ProgressLine(simulation, None) as progress:
        if request.policy is not None:
            trip = _with_policy(simulation, request, request.policy)
        else:
            trip = (
                _without_map(simulation, request)
                if request.options.no_map
                else _with_map(simulation, request)
            )
    run = make_report(simulation, trip.distance, progress.wall)
    report(run.findings)
    if as_json:
        print_json({**run.to_json(), "navigation": _navigation(trip, request.has_heading)})
    else:
        planned = "planned" if request.has_map else "straight"
        lengths = f"{trip.time:.2f} s, {trip.distance:.2f} m driven, {trip.shortest:.2f} m {planned}"
        click.echo(f"goal        {trip.status}" + (f" in {lengths}" if trip.reached else ""))
        if trip.shortest and not trip.reached:  # the reason is a sentence
            click.echo(f"            {lengths}")
        off = f"{trip.off * 1000.0:.1f} mm" if trip.off < 1.0 else f"{trip.off:.2f} m"
        turned = f" and {math.degrees(trip.turned_off):.1f} deg" if request.has_heading else ""
        click.echo(f"            {off}{turned} from the goal")
        click.echo(f"contact     {'with more than' if trip.collided else 'only with'} the ground")
        click.echo(run.to_text())
    return 0 if trip.reached else 1


def _with_map(simulation: Simulation, request: GotoRequest) -> Trip:
    """Drive on the world's own map. If the description declares a lidar, the robot also stops before
    obstacles that the lidar detects."""
    from kbot.navigation.with_map.go_to import go_to
    from kbot.sensors import LidarSensor
    from kbot.sensors.declared import mount_declared

    sensors, _ = mount_declared(simulation, strict=False)
    lidar = next((sensor for sensor in sensors.values() if isinstance(sensor, LidarSensor)), None)
    return go_to(
        simulation,
        request.goal,
        timeout=request.timeout,
        settings=request.options.settings(simulation),
        lidar=lidar,
        any_heading=not request.has_heading,
    )


def _without_map(simulation: Simulation, request: GotoRequest) -> Trip:
    from kbot.navigation.without_map.go_to import go_to_without_map

    return go_to_without_map(
        simulation,
        request.goal,
        any_heading=not request.has_heading,
        arrive=request.options.radius,
        max_speed=request.options.max_speed,
        timeout=request.timeout,
    )


def _with_policy(simulation: Simulation, request: GotoRequest, policy: Policy) -> Trip:
    from kbot.learn.policies.driving import go_to_with_policy
    from kbot.learn.policies.policy import ARRIVE

    arrive = ARRIVE if request.options.arrive is None else request.options.arrive
    return go_to_with_policy(simulation, policy, request.goal, arrive=arrive, timeout=request.timeout)


def _navigation(trip: Trip, has_heading: bool) -> dict[str, object]:
    goal = trip.status.goal
    return {
        "map": trip.map,
        "goal": {"x": goal.x, "y": goal.y, "yaw": goal.yaw if has_heading else None},
        "state": str(trip.state),
        "reason": trip.status.reason,
        "off_m": trip.off,
        "off_rad": trip.turned_off if has_heading else None,
        "time_s": trip.arrival,
        "shortest_m": trip.shortest,
        "odometry_error_m": trip.odometry_error,
        "collided": trip.collided,
    }
