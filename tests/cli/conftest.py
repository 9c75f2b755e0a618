"""Provides a recording for the tests of verbs."""

import pytest

import kbot
from kbot.record import Recorder
from kbot.record.feed import Feed
from kbot.sim import Simulation


@pytest.fixture(scope="module")
def recording(tmp_path_factory: pytest.TempPathFactory) -> str:
    """An MCAP recording of a robot that drives straight ahead for two seconds."""
    path = str(tmp_path_factory.mktemp("bag") / "run.mcap")
    sim = Simulation(kbot.load("kbot"))
    with Recorder(sim, Feed(sim.bus, lambda: sim.clock.nanoseconds), path):
        sim.cmd_vel(0.3, 0.0)
        sim.run(2.0)
    return path
