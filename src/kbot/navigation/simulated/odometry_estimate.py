"""The pose of a simulated robot in the world by its odometry."""

from __future__ import annotations

from kbot.kinematics.planar_pose import PlanarPose
from kbot.sim import Simulation


class OdometryEstimate:
    """Begins at the true pose of a simulation's first robot. After that, only odometry changes it."""

    def __init__(self, simulation: Simulation) -> None:
        self._simulation, self._time = simulation, simulation.time
        self._begin()

    @property
    def pose(self) -> PlanarPose:
        """The pose of the base in the world's frame."""
        return self._world_from_odom @ self._simulation.odometry.pose

    def look_for_jump(self) -> None:
        """Begin again if the robot was placed elsewhere, or the simulation was reset."""
        simulation = self._simulation
        was_set_back = simulation.time < self._time
        self._time = simulation.time
        if was_set_back or simulation.robots.first.jumps != self._jumps:
            self._begin()

    def _begin(self) -> None:
        simulation = self._simulation
        self._world_from_odom = simulation.ground_truth.pose @ simulation.odometry.pose.inverse()
        self._jumps = simulation.robots.first.jumps
