"""`kbot sim --goto`: drive to a pose, and report how that went."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import click

from kbot.cli.output import print_json, report

if TYPE_CHECKING:
    from kbot.kinematics import PlanarPose
    from kbot.sim import Simulation


def run_goto(simulation: Simulation, goal: PlanarPose, timeout: float | None, as_json: bool) -> int:
    """Go there by the world's own map; the exit status is 0 where it was reached, else 1.

    Where the description declares a flat lidar, the robot also stops before what that sees.
    """
    from kbot.cli.sim.progress import Progress  # lazy in this module: -h is fast
    from kbot.navigation.simulated import go_to
    from kbot.sensors import LidarSensor
    from kbot.sensors.declared import mount_declared
    from kbot.sim.report import make_report

    sensors, said = mount_declared(simulation)
    report(said)
    lidar = next((sensor for sensor in sensors.values() if isinstance(sensor, LidarSensor)), None)
    with Progress(simulation, None) as progress:
        trip = go_to(simulation, goal, timeout=timeout, lidar=lidar)
    run = make_report(simulation, trip.distance, progress.wall)
    if as_json:
        navigation = {
            "goal": {"x": goal.x, "y": goal.y, "yaw": goal.yaw},
            "state": str(trip.status.state),
            "reason": trip.status.reason,
            "off_m": trip.off,
            "off_rad": trip.turned_off,
            "time_s": trip.time,
            "shortest_m": trip.shortest,
            "odometry_error_m": trip.odometry_error,
            "collided": trip.collided,
        }
        print_json({**run.to_json(), "navigation": navigation})
    else:
        planned = f" in {trip.time:.2f} s, {trip.distance:.2f} m of a path of {trip.shortest:.2f} m"
        click.echo(f"goal        {trip.status}" + (planned if trip.shortest else ""))
        click.echo(
            f"            {trip.off * 1000.0:.1f} mm and {math.degrees(trip.turned_off):.1f} deg from it"
        )
        click.echo(f"contact     {'with more than' if trip.collided else 'only with'} the ground")
        click.echo(run.to_text())
    return 0 if trip.reached else 1
