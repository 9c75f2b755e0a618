"""Lets a controller drive a simulated robot."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from kbot.brief import Brief
from kbot.navigation.controller import Controller, Observation, require_rate
from kbot.navigation.simulated.fall import describe_fall
from kbot.navigation.simulated.lidars import LidarPoints
from kbot.navigation.simulated.odometry_estimate import OdometryEstimate
from kbot.sim import Simulation
from kbot.text import KbotError

RATE = 50.0
"""Updates of a controller per second."""

PoseSource = Literal["ground_truth", "odometry"]
Seen = Callable[[], tuple[NDArray[np.float64] | None, float]]
"""Returns the obstacles, and the time at which they were detected."""


def require_pose_source(pose: object) -> None:
    """Raises KbotError: not a `PoseSource`."""
    if pose not in ("ground_truth", "odometry"):
        raise KbotError(f"pose must be 'ground_truth' or 'odometry', not {pose!r}")


class Pilot(Brief):
    """Lets a controller drive a simulation's robot until it is closed.

    The controller gets the true pose, as from a perfect localisation, or the pose from odometry."""

    def __init__(
        self,
        simulation: Simulation,
        controller: Controller,
        rate: float = RATE,
        pose: PoseSource = "ground_truth",
        seen: Seen | None = None,
        estimate: OdometryEstimate | None = None,
    ) -> None:
        """`seen` returns the obstacles and the time at which they were detected, as `LidarPoints` does.
        `estimate` is the pose from odometry, by default one that begins now.

        Raises KbotError: `pose` is something else, or the controller must be updated more often than `rate`.
        """
        require_pose_source(pose)
        self._simulation, self._controller, self._source, self._seen = simulation, controller, pose, seen
        self.estimate = estimate or OdometryEstimate(simulation)
        self._timer = simulation.clock.every(require_rate(controller, rate), self.tick)

    def observe(self) -> Observation:
        sim = self._simulation
        points, seen_at = self._seen() if self._seen else (None, -math.inf)
        if self._source == "ground_truth":
            motion = sim.ground_truth
            pose = motion.pose
        else:
            motion = sim.odometry
            pose = self.estimate.pose
        view = self._seen.view if isinstance(self._seen, LidarPoints) else None
        age, fallen = sim.time - seen_at, describe_fall(sim)
        return Observation(sim.time, pose, motion.twist, points, age, fallen, view=view)

    def tick(self) -> None:
        """Update the controller once and command its twist."""
        wanted = self._controller.update(self.observe())
        self._simulation.cmd_vel(wanted.linear.x, wanted.angular.z, wanted.linear.y)

    def close(self) -> None:
        """Stop calling the controller. The robot keeps its last command."""
        self._timer.cancel()
