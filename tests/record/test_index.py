"""Access to recordings by time, in each format."""

from pathlib import Path

import pytest
from mcap.writer import Writer

from kbot.record.index import open_index
from kbot.record.mcap_file import McapIndex
from kbot.sim import Simulation
from kbot.text import KbotError

from .conftest import record


@pytest.mark.parametrize("kind", ["mcap", "bag", "ros2"])
def test_newest_message_of_a_topic(runs: dict[str, Path], kind: str) -> None:
    """Odometry is published every 20 ms, first at 20 ms."""
    index = open_index(str(runs[kind]))
    assert index.topics["/odom"] == "nav_msgs/msg/Odometry"
    assert index.newest("/odom", 19_000_000) is None
    for asked, expected in ((20.0, 20), (39.9, 20), (510.0, 500), (99e3, 1520)):
        entry = index.newest("/odom", round(asked * 1e6))
        assert entry is not None
        assert entry.nanoseconds == expected * 1_000_000
        stamp = entry.message().header.stamp
        assert stamp.sec * 1000 + stamp.nanosec // 1_000_000 == expected
    found = list(index.between(("/odom",), 80_000_000, 140_000_000))
    assert [entry.nanoseconds // 1_000_000 for entry in found] == [100, 120, 140]
    assert index.counts["/odom"] == 76  # every 20 ms from 20 to 1520
    index.close()


def test_messages_after_a_reset_replace_earlier_ones(tmp_path: Path) -> None:
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


def test_large_recording_without_index_is_refused(
    runs: dict[str, Path], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    file = tmp_path / "cut.mcap"
    file.write_bytes(runs["mcap"].read_bytes()[:-100])
    open_index(str(file)).close()
    monkeypatch.setattr("kbot.record.index.memory_limit", lambda path: 1000)
    with pytest.raises(KbotError, match="has no usable index, and is too large"):
        open_index(str(file))


def test_file_without_statistics_is_not_read_to_count_messages(tmp_path: Path) -> None:
    with (tmp_path / "run.mcap").open("wb") as stream:
        writer = Writer(stream, use_statistics=False)
        writer.start()
        schema = writer.register_schema("std_msgs/msg/String", "ros2msg", b"string data")
        channel = writer.register_channel("/chatter", "cdr", schema)
        writer.add_message(channel, 1, b"\0\1\0\0\2\0\0\0a\0", 1)
        writer.finish()
    index = open_index(str(tmp_path / "run.mcap"))
    assert isinstance(index, McapIndex)
    assert dict(index.counts) == {}
    index.close()
