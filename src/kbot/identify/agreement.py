"""How far a simulated run of a robot is from a log: the simulation drives with the log's wheel speeds."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from kbot.identify.log import Array, DriveLog, motions_of
from kbot.identify.nominal import Nominal
from kbot.kinematics.angles import wrap
from kbot.kinematics.planar_pose import PlanarPose, integrate
from kbot.sim import Simulation
from kbot.text import KbotError

_WINDOW = 5.0
"""Length in s of the drives whose ends are compared. Errors grow with the length."""
_LONGEST = 60.0
"""Time in s of the log that is simulated."""
_MOST_DISTURBED = 0.1
"""Share of disturbed displacements up to which a drive is compared."""
_FEWEST = 3
"""Drives without which a median means little."""
_ROUNDING = 1e-6
"""Difference in rad between two simulations of the same motion."""
_CONTROL, _GAIN = 0.02, 8.0
"""Time in s between two commands to the wheels, and the additional speed in rad/s for each rad that a wheel
is behind."""


@dataclass(frozen=True, slots=True)
class Agreement:
    """The median distance in m and angle in rad between the simulation and the log after `seconds` s."""

    distance: float
    angle: float
    seconds: float
    drives: int

    def is_farther_than(self, other: Agreement) -> bool:
        """Whether the distance or the angle is larger than that of another description."""
        return self.distance > other.distance or self.angle > other.angle + _ROUNDING


def agreement(log: DriveLog, nominal: Nominal, is_disturbed: NDArray[np.bool_]) -> Agreement:
    """Simulate the first minute of a log on an empty plane.

    `is_disturbed` marks the displacements during which the robot slipped or collided. Drives in which the
    robot stands all the time are not compared: every description agrees with them.

    Raises:
        KbotError: the log has no drives of some seconds with wheel speeds and a reference of a pose.
    """
    motions = motions_of(log)
    ends = np.concatenate([[0.0], np.cumsum(np.nan_to_num(log.durations))])
    robot = nominal.loaded.require()
    simulation = Simulation(robot)
    wheels = _Wheels(simulation, nominal)
    link = nominal.sensor_link or nominal.drive.base
    nominal = nominal.with_sensor(link)
    distances, angles = list[float](), list[float]()
    measured: PlanarPose | None = None
    before = PlanarPose()
    begun, last = 0.0, -1
    is_known: NDArray[np.bool_] = np.logical_and.reduce(np.isfinite(motions.displacements), axis=1)
    disturbances, moves = list[bool](), list[bool]()
    for start, stop, displacement, known, disturbed, moving in zip(
        motions.start.tolist(),
        motions.stop.tolist(),
        motions.displacements,
        is_known.tolist(),
        is_disturbed.tolist(),
        motions.is_moving.tolist(),
        strict=True,
    ):
        if ends[stop] - ends[0] > _LONGEST:
            break
        for index in range(start, stop):
            wheels.turn(log.wheel_speeds[index], float(log.durations[index]))
        place = simulation.link_pose(link)
        simulated = wheels.caught_up(
            PlanarPose(float(place.translation[0]), float(place.translation[1]), place.yaw)
        )
        is_gap = measured is None or start != last or not known
        last = stop
        if measured is not None and not is_gap:
            measured = measured @ PlanarPose(*displacement.tolist())
            disturbances.append(disturbed)
            moves.append(moving)
            if ends[stop] - begun < _WINDOW - 1e-6:
                continue
            if any(moves) and np.mean(disturbances) <= _MOST_DISTURBED:
                moved = before.inverse() @ simulated
                distances.append(math.hypot(moved.x - measured.x, moved.y - measured.y))
                angles.append(abs(wrap(moved.yaw - measured.yaw)))
        measured, before, begun = PlanarPose(), simulated, float(ends[stop])  # the next drive begins here
        disturbances.clear()
        moves.clear()
    if len(distances) < _FEWEST:
        raise KbotError(f"{log.path} has no drives of {_WINDOW:g} s without slip that have a reference")
    return Agreement(float(np.median(distances)), float(np.median(angles)), _WINDOW, len(distances))


class _Wheels:
    """Turns the wheels of a simulation as those of the log, although its motors accelerate slowly."""

    def __init__(self, simulation: Simulation, nominal: Nominal) -> None:
        settings = simulation.robots.named(None).settings
        if settings is None:
            raise KbotError("the robot does not drive in the simulation")
        self._simulation, self._settings = simulation, settings
        self._nominal, self._drive = nominal, nominal.drive
        self._start = self._angles()
        self._wanted = np.zeros(2)

    def _angles(self) -> Array:
        positions, forward = self._simulation.joint_positions, self._drive.forward
        sides = (self._drive.left, self._drive.right)
        return np.array([np.mean([positions[name] * forward[name] for name in side]) for side in sides])

    @property
    def _behind(self) -> Array:
        """Angles in rad by which the left and right wheel have turned less than those of the log."""
        behind: Array = self._wanted + self._start - self._angles()
        return behind

    def caught_up(self, pose: PlanarPose) -> PlanarPose:
        """The pose of the sensor after the wheels have rolled what they are behind."""
        left, right = (self._behind * (self._nominal.left, self._nominal.right)).tolist()
        axle = (self._nominal.axle_from_sensor or PlanarPose()).inverse()
        return integrate(pose, left, right, self._drive.separation, axle)

    def turn(self, speeds: Array, seconds: float) -> None:
        """Turn the left and right wheel at speeds in rad/s, and catch up with what is behind."""
        for _ in range(steps := max(1, round(seconds / _CONTROL))):
            left, right = (speeds + _GAIN * self._behind).tolist()
            self._wanted += speeds * (seconds / steps)
            linear = (left + right) / 2.0 * self._settings.radius
            turning = (right - left) * self._settings.radius / self._settings.separation
            self._simulation.cmd_vel(linear, turning)
            # an interval of a fast log may round to no step: the next interval then catches up
            self._simulation.step(round(seconds / steps / self._simulation.timestep))
