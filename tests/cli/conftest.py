"""A recording that verbs are given."""

import pytest

import kbot
from kbot.record import Recorder
from kbot.record.feed import Feed
from kbot.sim import Simulation


@pytest.fixture(scope="module")
def recording(tmp_path_factory: pytest.TempPathFactory) -> str:
    """Two seconds straight ahead, as MCAP."""
    path = str(tmp_path_factory.mktemp("bag") / "run.mcap")
    sim = Simulation(kbot.load("kbot"))
    with Recorder(sim, Feed(sim.bus, lambda: sim.clock.nanoseconds), path):
        sim.cmd_vel(0.3, 0.0)
        sim.run(2.0)
    return path
