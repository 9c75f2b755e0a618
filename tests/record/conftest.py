"""A short run, and its recordings."""

from collections.abc import Callable
from pathlib import Path

import pytest

import kbot
from kbot.record import Recorder
from kbot.record.feed import Feed
from kbot.sim import Simulation

Drive = Callable[[Simulation], None]


def drive(sim: Simulation) -> None:
    """Commands of all kinds, with steps of different lengths."""
    sim.cmd_vel(0.3, 0.4)
    sim.run(0.5)
    sim.robots.first.command(0.1, 0.0)
    sim.run(0.713)
    sim.bus.publish("/cmd_vel", kbot.messages.Twist(kbot.messages.Vector3(0.2)))
    sim.step(7)
    sim.cmd_vel(0.0, -1.0)
    sim.run(0.3)


def record(path: Path, how: Drive = drive, **options: object) -> tuple[Simulation, Recorder]:
    """Record a run of KBot among boxes. `options` are passed to the recorder."""
    sim = Simulation(kbot.load("kbot"), "boxes")
    recorder = Recorder(sim, Feed(sim.bus, lambda: sim.clock.nanoseconds), str(path), **options)
    with recorder:
        how(sim)
    return sim, recorder


@pytest.fixture(scope="session")
def runs(tmp_path_factory: pytest.TempPathFactory) -> dict[str, Path]:
    """The same run in each format."""
    folder = tmp_path_factory.mktemp("runs")
    found = {
        kind: folder / name for kind, name in (("mcap", "run.mcap"), ("bag", "run.bag"), ("ros2", "run"))
    }
    with pytest.MonkeyPatch.context() as patch:
        # on a busy machine, flushing once a second would give more chunks
        patch.setattr("kbot.record.recorder.FLUSH_SECONDS", float("inf"))
        for path in found.values():
            record(path)
    return found
