"""Recordings by time, in each format."""

from pathlib import Path

import pytest

from kbot.record.index import open_index
from kbot.sim import Simulation

from .conftest import record


@pytest.mark.parametrize("kind", ["mcap", "bag", "ros2"])
def test_what_a_topic_said_last(runs: dict[str, Path], kind: str) -> None:
    """Odometry is said every 20 ms, the first time after 20 ms."""
    index = open_index(str(runs[kind]))
    assert index.topics["/odom"] == "nav_msgs/msg/Odometry"
    assert index.newest("/odom", 19_000_000) is None
    for asked, said in ((20.0, 20), (39.9, 20), (510.0, 500), (99e3, 1520)):
        entry = index.newest("/odom", round(asked * 1e6))
        assert entry is not None
        assert entry.nanoseconds == said * 1_000_000
        stamp = entry.message().header.stamp
        assert stamp.sec * 1000 + stamp.nanosec // 1_000_000 == said
    found = list(index.between(("/odom",), 80_000_000, 140_000_000))
    assert [entry.nanoseconds // 1_000_000 for entry in found] == [100, 120, 140]
    index.close()


def test_time_that_was_set_back_counts_from_then_on(tmp_path: Path) -> None:
    def twice(sim: Simulation) -> None:
        sim.cmd_vel(0.3, 0.0)
        sim.run(1.0)
        sim.reset()
        sim.run(0.5)

    record(tmp_path / "run.mcap", twice)
    index = open_index(str(tmp_path / "run.mcap"))
    last = index.newest("/odom", 99_000_000_000)
    assert last is not None
    assert last.nanoseconds == 500_000_000
    assert last.message().pose.pose.position.x == pytest.approx(0.0, abs=1e-9)
    index.close()
