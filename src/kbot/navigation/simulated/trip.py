"""Runs a simulation while a pilot drives its robot to a goal, and measures how the goal ended."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Literal

from kbot.brief import Brief
from kbot.kinematics.angles import wrap
from kbot.kinematics.planar_pose import PlanarPose
from kbot.navigation.goal_status import GoalReport, GoalState
from kbot.navigation.simulated.arrival_watch import ArrivalWatch
from kbot.navigation.simulated.collision_watch import CollisionWatch
from kbot.sim import Simulation
from kbot.sim.report import Odometer


@dataclass(frozen=True, slots=True, repr=False)
class Trip(Brief):
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
        return abs(wrap(self.status.goal.yaw - self.pose.yaw))

    @property
    def state(self) -> GoalState:
        """The final state, which equals its text: `trip.state == "reached"`."""
        return self.status.state

    @property
    def reached(self) -> bool:
        return self.state is GoalState.REACHED


def run_trip(
    simulation: Simulation,
    goal: PlanarPose,
    arrive: float,
    rate: float,
    report: Callable[[], GoalReport],
    estimate: Callable[[], PlanarPose],
    close: Callable[[], None],
) -> Trip:
    """Run the simulation while a pilot drives to a goal, until the goal has ended. The robot is then stopped.

    The state of the goal is the one that the pilot reports.

    Args:
        simulation: whose first robot drives.
        goal: in the world's frame.
        arrive: radius in m within which the goal is reached.
        rate: how often the goal's state is checked, in Hz.
        report: returns the goal's state as the pilot knows it.
        estimate: returns the pilot's estimate of the robot's pose.
        close: stops the pilot.
    """
    start, begun = simulation.ground_truth.pose, simulation.time
    status = report()
    odometer = Odometer(simulation)
    arrival, collisions = ArrivalWatch(simulation, goal, arrive), CollisionWatch(simulation)
    try:
        while not status.state.is_end:
            simulation.run(1.0 / rate)
            status = report()
        took = simulation.time - begun
        simulation.cmd_vel(0.0, 0.0)
        close()
        simulation.run(0.5)
    finally:
        close()
        odometer.close()
        arrival.close()
        collisions.close()
    true, believed = simulation.ground_truth.pose, estimate()
    error = math.hypot(true.x - believed.x, true.y - believed.y)
    straight = math.hypot(goal.x - start.x, goal.y - start.y)
    return Trip(
        status, took, odometer.distance, straight, true, error, collisions.collided, arrival.time, "none"
    )


def judged(trip: Trip) -> Trip:
    """The same trip with the state of its goal by the true position, which the robot does not know."""
    goal = trip.status.goal
    if trip.arrival is not None:
        return replace(trip, status=GoalReport(goal, GoalState.REACHED))
    if not trip.reached:
        return trip
    reason = (
        f"the robot stopped {trip.off:.3f} m from the goal, because its pose estimate is"
        f" {trip.odometry_error:.3f} m off"
    )
    return replace(trip, status=GoalReport(goal, GoalState.STUCK, reason))
