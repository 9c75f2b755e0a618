"""The report at the end of a headless run."""

from __future__ import annotations

import math
from dataclasses import dataclass

from kbot.kinematics.angles import wrap
from kbot.kinematics.planar_pose import PlanarPose
from kbot.sim.simulation import Simulation
from kbot.text import Diagnostic
from kbot.text.render import to_json

SAMPLE = 0.02
"""Seconds between two positions whose distance is added up."""


@dataclass(frozen=True, slots=True)
class RunReport:
    """The final state of a run.

    `pose` is in the world, `odometry` is relative to `start`, and `distance` is the base's true path length
    in m. `turned` is its turn to the left since `start` in rad, with full turns. `findings` are those of the
    run.
    """

    pose: PlanarPose
    odometry: PlanarPose
    distance: float
    turned: float
    steps: int
    simulated: float
    wall: float
    sha256: str
    start: PlanarPose
    findings: tuple[Diagnostic, ...] = ()

    @property
    def real_time_factor(self) -> float:
        return self.simulated / self.wall if self.wall > 0.0 else 0.0

    def to_json(self) -> dict[str, object]:
        """As `kbot sim --headless --json` prints it: m, rad, s."""
        return {
            "pose": _planar(self.pose),
            "odometry": _planar(self.odometry),
            "distance_m": self.distance,
            "turned_rad": self.turned,
            "steps": self.steps,
            "simulated_s": self.simulated,
            "wall_s": round(self.wall, 6),
            "real_time_factor": round(self.real_time_factor, 2),
            "state_sha256": self.sha256,
            "findings": [to_json(finding) for finding in self.findings],
        }

    def to_text(self) -> str:
        believed = self.start @ self.odometry
        off = math.hypot(self.pose.x - believed.x, self.pose.y - believed.y)
        return "\n".join(
            (
                f"simulated   {self.simulated:.3f} s in {self.wall:.2f} s"
                f" ({self.real_time_factor:.0f} times real time)",
                f"pose        {_words(self.pose)}",
                f"odometry    {_words(self.odometry)}   {off * 1000:.3f} mm off",
                f"distance    {self.distance:.4f} m",
                f"state       {self.sha256}",
            )
        )


class Odometer:
    """Measures the true path length of a simulation's robot. With `keeps`, it keeps the poses as well."""

    def __init__(self, simulation: Simulation, keeps: bool = False) -> None:
        self._simulation = simulation
        self._keeps = keeps
        self._last = simulation.ground_truth.pose
        self.truth = [self._last]
        self.odometry = [simulation.odometry.pose]
        self.distance = 0.0
        self._timer = simulation.clock.every(1.0 / SAMPLE, self.sample)

    def sample(self) -> None:
        """Add the distance since the last sample."""
        pose = self._simulation.ground_truth.pose
        self.distance += math.hypot(pose.x - self._last.x, pose.y - self._last.y)
        self._last = pose
        if self._keeps:
            self.truth.append(pose)
            self.odometry.append(self._simulation.odometry.pose)

    def close(self) -> None:
        self.sample()
        self._timer.cancel()


def make_report(simulation: Simulation, distance: float, wall: float) -> RunReport:
    """The report of the current state, after `wall` seconds of wall-clock time."""
    truth, start = simulation.ground_truth, simulation.start
    return RunReport(
        truth.pose,
        simulation.odometry.pose,
        distance,
        truth.unwrapped_yaw - start.yaw,
        simulation.steps,
        simulation.time,
        wall,
        simulation.state_sha256(),
        start,
        simulation.findings,
    )


def _planar(pose: PlanarPose) -> dict[str, float]:
    return {"x": pose.x, "y": pose.y, "yaw": pose.yaw}


def _words(pose: PlanarPose) -> str:
    x, y, yaw = _rounded(pose.x, 4), _rounded(pose.y, 4), heading(pose.yaw, 3)
    return f"x {x:8.4f} m   y {y:8.4f} m   yaw {yaw:9.3f} deg"


def heading(yaw: float, digits: int) -> float:
    """A yaw in rad as degrees above -180 and up to 180."""
    degrees = _rounded(math.degrees(wrap(yaw)), digits)
    return degrees if degrees > -180.0 else 180.0  # as rounded


def _rounded(value: float, digits: int) -> float:
    """Round a value, and print 0.0000 instead of -0.0000."""
    return round(value, digits) + 0.0
