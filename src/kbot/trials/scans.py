"""What lidars measure during a run, so that the scans of two robots can be compared beam by beam."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from kbot.sensors.lidar import Lidar
from kbot.sensors.rays import Rays
from kbot.sim import Simulation

SCAN_RATE = 2.0
"""Scans per second of simulated time. A robot at 0.3 m/s, its speed on a path, moves 15 cm in between."""
MOST_BEAMS = 360
"""Beams of each scan that are compared, evenly spaced: a cloud of 30,000 beams takes 100 times longer."""
APART = 0.05
"""Difference in m from which two ranges of a beam are different: 3.5 standard deviations of the difference
of two ranges with a noise of 1 cm, which most descriptions declare."""

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Scans:
    """The scans of one lidar, without noise in a simulation.

    directions  unit vectors of the beams in the sensor's frame, (beams, 3)
    range_max   m
    ranges      m, (scans, beams), inf where a beam returns nothing
    """

    directions: Array
    range_max: float
    ranges: NDArray[np.float32]

    def difference(self, other: Scans) -> tuple[float, float]:
        """The median difference of the ranges in m, and the share of beams that differ by more than `APART`.

        Scans are compared in order, as long as both have one. Only beams that return something in at least
        one of the two scans count. A beam without a return has the range `range_max`. NaN: no beam returns
        something, or the beams of both do not have the same directions.
        """
        if self.directions.shape != other.directions.shape or not np.allclose(
            self.directions, other.directions, atol=1e-6
        ):
            return math.nan, math.nan
        count = min(len(self.ranges), len(other.ranges))
        one, two = self.ranges[:count], other.ranges[:count]
        seen = np.isfinite(one) | np.isfinite(two)
        if not seen.any():
            return math.nan, math.nan
        apart = np.abs(np.minimum(one, self.range_max) - np.minimum(two, other.range_max))[seen]
        return float(np.median(apart)), float((apart > APART).mean())


def compared_beams(count: int) -> NDArray[np.intp]:
    """The indices of at most `MOST_BEAMS` of `count` beams, evenly spaced."""
    return np.unique(np.linspace(0, count - 1, min(count, MOST_BEAMS)).round().astype(np.intp))


class ScanSampler:
    """Measures the scans of some lidars of the first robot at `SCAN_RATE`, also without a subscriber."""

    def __init__(self, simulation: Simulation, lidars: Mapping[str, Lidar]) -> None:
        self._simulation = simulation
        self._lidars = [_Lidar(simulation, name, spec) for name, spec in lidars.items()]
        if self._lidars:
            simulation.clock.every(SCAN_RATE, self._sample)

    def scans(self) -> dict[str, Scans]:
        """The scans so far, by the lidar's name."""
        return {lidar.name: lidar.scans() for lidar in self._lidars}

    def _sample(self) -> None:
        simulation = self._simulation
        parts = (part for body in simulation.world.bodies for part in body.parts)
        # with ground alone, beams return something only while the robot tilts: the lidar is not the reason
        has_objects = len(simulation.robots) > 1 or any(not part.ground for part in parts)
        for lidar in self._lidars:
            lidar.sample(simulation, has_objects=has_objects)


class _Lidar:
    def __init__(self, simulation: Simulation, name: str, spec: Lidar) -> None:
        self.name, self._spec = name, spec
        beams = spec.directions
        self._directions = beams[compared_beams(len(beams))]
        self._rays = Rays(simulation.robots.first.name, self._directions)
        self._ranges: list[NDArray[np.float32]] = []

    def sample(self, simulation: Simulation, *, has_objects: bool) -> None:
        """Add a scan. Without objects in the world, no beam returns something."""
        spec = self._spec
        if not has_objects:
            self._ranges.append(np.full(len(self._directions), np.inf, dtype=np.float32))
            return
        pose = simulation.link_pose(spec.link) @ spec.pose
        found = self._rays.cast(*simulation.engine.current(), pose.translation, pose.rotation, spec.range_max)
        # nearer than `range_min` is an error of the sensor, the same for both robots
        self._ranges.append(np.maximum(found, spec.range_min).astype(np.float32))

    def scans(self) -> Scans:
        ranges = np.array(self._ranges, dtype=np.float32).reshape(-1, len(self._directions))
        return Scans(self._directions, self._spec.range_max, ranges)
