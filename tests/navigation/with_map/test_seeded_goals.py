"""The short form of benchmarks/bench_navigation.py: KBot reaches each goal without a collision."""

import importlib.util
from pathlib import Path

import pytest

from kbot.model.load import load_robot

SCENARIOS = Path(__file__).parents[3] / "benchmarks" / "seeded_goals.py"
HARD_ROOMS = (59, 66, 77, 86)
"""Rooms with a goal beside an obstacle. A robot that leaves its path near such a goal runs into it."""


@pytest.fixture(scope="module")
def scenarios():
    spec = importlib.util.spec_from_file_location("seeded_goals", SCENARIOS)
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


@pytest.mark.parametrize("with_lidar", [False, True], ids=["without_lidar", "with_lidar"])
@pytest.mark.parametrize(
    ("world", "seeds", "slowest"),
    # the measured ratio plus 0.03, because other processors round differently
    [("maze", range(10), 1.23), ("rooms", range(10), 1.30), ("rooms", HARD_ROOMS, 1.23)],
    ids=["mazes", "rooms", "hard_rooms"],
)
def test_goals_are_reached_without_a_collision_in_good_time(scenarios, world, seeds, slowest, with_lidar):
    robot = load_robot("kbot").require()
    trips = {
        seed: scenarios.drive(robot, *getattr(scenarios, world)(seed), with_lidar=with_lidar)
        for seed in seeds
    }
    assert {seed: str(trip.status) for seed, trip in trips.items() if not trip.reached} == {}
    assert [seed for seed, trip in trips.items() if trip.collided] == []
    assert max(trip.off for trip in trips.values()) <= 0.01
    ideal = sum(trip.time / scenarios.time_ratio(trip) for trip in trips.values())
    assert sum(trip.time for trip in trips.values()) / ideal <= slowest
