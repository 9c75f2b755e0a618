"""Runs a simulation until its robot has reached a goal without a map."""

from __future__ import annotations

from kbot.kinematics.planar_pose import PlanarPose
from kbot.navigation.controller import GENTLE
from kbot.navigation.simulated.trip import Trip, judged, run_trip
from kbot.navigation.without_map.local_navigator import LocalSettings
from kbot.navigation.without_map.local_pilot import DEFAULT_SETTINGS, LocalPilot, local_navigator
from kbot.sim import Simulation


def go_to_without_map(
    simulation: Simulation,
    goal: PlanarPose,
    *,
    any_heading: bool = False,
    arrive: float = GENTLE.distance,
    max_speed: tuple[float, float] | None = None,
    timeout: float | None = None,
    settings: LocalSettings = DEFAULT_SETTINGS,
) -> Trip:
    """Run the simulation until its robot has reached the goal or gives up. The robot is then stopped.

    The robot knows its start pose, and then only what its own lidars, wheels and IMU measure. It stops by its
    own estimate. The goal is reached if the true position came within `arrive`.

    Args:
        simulation: whose first robot drives.
        goal: in the world's frame.
        any_heading: the goal's yaw does not matter.
        arrive: radius in m within which the goal is reached.
        max_speed: m/s and rad/s, by default the limits that the robot declares.
        timeout: time limit in s, by default from the distance of the goal.
        settings: of the navigator.

    Raises:
        KbotError: the robot cannot drive, has no size or no level lidar, a number is not finite or not above
            0, or the goal is too far away.
    """
    navigator, lidars = local_navigator(simulation, max_speed, settings)
    status = navigator.go(goal, any_heading, arrive, timeout)
    pilot = LocalPilot(simulation, navigator, lidars)
    trip = run_trip(
        simulation,
        goal,
        arrive,
        settings.rate,
        lambda: navigator.status or status,
        lambda: pilot.estimate.pose,
        pilot.close,
    )
    return judged(trip)
