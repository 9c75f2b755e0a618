"""The scans of a run, and how much the scans of two runs differ."""

from __future__ import annotations

import math

import numpy as np
import pytest

from kbot.kinematics.transform import Transform
from kbot.model.load import load_robot
from kbot.sensors.declared import mount_declared
from kbot.sensors.lidar import Lidar
from kbot.sim import Simulation
from kbot.trials.scans import MOST_BEAMS, Scans, ScanSampler
from kbot.world.builders import WALL_THICKNESS

AHEAD, LEFT, BACK = (1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (-1.0, 0.0, 0.0)


def scans(*ranges: list[float], range_max: float = 8.0, ahead: tuple[float, ...] = AHEAD) -> Scans:
    return Scans(np.array([ahead, LEFT, BACK]), range_max, np.array(ranges, dtype=np.float32))


ONE_BEAM = Scans(np.array([AHEAD]), 8.0, np.ones((1, 1), np.float32))


@pytest.mark.parametrize(
    ("one", "other", "median", "share"),
    [
        (scans([1.0, 2.0, 3.0]), scans([1.0, 2.0, 3.0]), 0.0, 0.0),
        # differences of 0.04, 0.5 and 1 m: two of three beams are further apart than 0.05 m
        (scans([1.0, 2.0, 3.0]), scans([1.04, 2.5, 2.0]), 0.5, 2.0 / 3.0),
        # no return counts as the highest range, 8 m; the beam without a return in both does not count
        (scans([1.0, 2.0, math.inf]), scans([math.inf, 2.0, math.inf]), 3.5, 0.5),
        # the second scan of the longer run has no counterpart
        (scans([1.0, 1.0, 1.0]), scans([1.0, 1.0, 1.0], [5.0, 5.0, 5.0]), 0.0, 0.0),
        (scans([math.inf] * 3), scans([math.inf] * 3), math.nan, math.nan),
        (scans([1.0, 2.0, 3.0]), scans([1.0, 2.0, 3.0], ahead=(0.6, 0.8, 0.0)), math.nan, math.nan),
        (scans([1.0, 2.0, 3.0]), ONE_BEAM, math.nan, math.nan),
    ],
)  # fmt: skip
def test_the_difference_of_scans(one: Scans, other: Scans, median: float, share: float) -> None:
    assert one.difference(other) == pytest.approx((median, share), abs=1e-6, nan_ok=True)


@pytest.mark.parametrize(("world", "is_seen"), [("empty", False), ("corridor", True)])
def test_the_ground_alone_is_not_an_object(world: str, is_seen: bool) -> None:
    simulation = Simulation(load_robot("kbot").require(), world)
    down = Transform.from_xyz_rpy((0.0, 0.0, 0.1), (0.0, 0.5, 0.0))  # looks at the ground ahead
    lidar = Lidar(link="base_link", name="down", pose=down, angle_min=-0.1, angle_max=0.1)
    sampler = ScanSampler(simulation, {"down": lidar})
    simulation.run(0.6)
    assert np.isfinite(sampler.scans()["down"].ranges).any() == is_seen


def test_a_lidar_in_a_corridor_sees_its_walls() -> None:
    simulation = Simulation(load_robot("kbot", {"lidar": "true"}).require(), "corridor:width=0.8,length=6")
    sensors, _ = mount_declared(simulation)
    spec = sensors["lidar"].spec
    assert isinstance(spec, Lidar)
    sampler = ScanSampler(simulation, {"lidar": spec})
    simulation.run(1.1)
    found = sampler.scans()["lidar"]
    assert len(found.ranges) >= 2
    assert found.directions.shape == (min(MOST_BEAMS, spec.samples), 3)
    place = simulation.link_pose(spec.link).translation
    for way, distance in (
        (AHEAD, 5.5 - place[0]),
        (LEFT, 0.4 - place[1]),
    ):
        (beam,) = np.flatnonzero(found.directions @ np.array(way) > 1.0 - 1e-6)
        # the middles of the walls are at 5.5 and 0.4 m
        assert found.ranges[-1, beam] == pytest.approx(distance - WALL_THICKNESS / 2.0, abs=1e-3)
