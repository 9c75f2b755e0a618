"""Playing back recordings, Parquet export, and a run that is ended by a signal."""

import json
import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import pyarrow.parquet
import pytest

from kbot.cli.main import run
from kbot.messages import (
    Bus,
    Clock,
    ClockMessage,
    Header,
    Odometry,
    TFMessage,
    Transform,
    TransformStamped,
)
from kbot.record import Recording
from kbot.record.feed import Feed
from kbot.record.player import Player
from kbot.record.writer import open_writer
from kbot.text import KbotError


@pytest.mark.parametrize("kind", ["mcap", "bag", "ros2"])
def test_recording_is_played_back_in_order(runs: dict[str, Path], kind: str) -> None:
    player = Player(str(runs[kind]))
    received: list[tuple[float, object]] = []
    for topic, message_type in (("/odom", Odometry), ("/tf", TFMessage)):
        player.bus.subscribe(topic, message_type, lambda m: received.append((player.seconds, m)))
    assert player.advance(0.5)
    odometry = [(at, m) for at, m in received if isinstance(m, Odometry)]
    assert [round(at, 3) for at, _ in odometry] == [round(0.02 * n, 3) for n in range(1, 26)]
    assert odometry[-1][1].header.stamp.nanosec == 500_000_000
    while player.advance(0.1):
        continue
    recorded = [e for e in Recording(str(runs[kind])).entries() if e.topic == "/odom"]
    assert sum(isinstance(m, Odometry) for _, m in received) == len(recorded)
    assert "<robot" in player.description
    player.rewind()
    assert player.seconds < 0.021


def test_several_recordings_are_played_back_as_one(runs: dict[str, Path], tmp_path: Path) -> None:
    """A run whose topics are in separate files, with the later part of one in a third file."""
    whole, parts = str(runs["mcap"]), [str(tmp_path / name) for name in ("odom.bag", "tf.mcap", "late.mcap")]
    assert run(["bag", "cut", whole, parts[0], "--topic", "/odom", "--end", "0.5"]) == 0
    assert run(["bag", "cut", whole, parts[1], "--topic", "/tf"]) == 0
    assert run(["bag", "cut", whole, parts[2], "--topic", "/odom", "--start", "0.51"]) == 0

    def received(*files: str) -> list[tuple[str, object]]:
        player, found = Player(*files, topics=("/odom", "/tf")), []
        for topic, message_type in (("/odom", Odometry), ("/tf", TFMessage)):
            player.bus.subscribe(topic, message_type, lambda m, t=topic: found.append((player.seconds, t, m)))
        while player.advance(0.1):
            continue
        return sorted(found, key=lambda item: item[:2])

    assert received(*parts) == received(whole)
    with pytest.raises(KbotError, match=r"odom\.bag, .*late\.mcap has no topic /tff: did you mean '/tf'"):
        Player(*parts, topics=("/tff",))


def test_topic_of_two_types_is_refused(runs: dict[str, Path], tmp_path: Path) -> None:
    other = tmp_path / "other.mcap"
    bus, writer = Bus(), open_writer(str(other))
    publisher = bus.advertise("/odom", ClockMessage)
    Feed(bus, lambda: 1).open("/odom", writer.write)
    publisher.publish(ClockMessage())
    writer.close()
    with pytest.raises(
        KbotError, match="/odom has two types, nav_msgs/msg/Odometry and rosgraph_msgs/msg/Clock"
    ):
        Player(str(runs["mcap"]), str(other))


def test_time_span_and_topics_can_be_selected(runs: dict[str, Path]) -> None:
    player = Player(str(runs["mcap"]), topics=("/odom",), start=0.4, seconds=0.2)
    assert list(player.bus.topics) == ["/odom"]
    received: list[float] = []
    player.bus.subscribe("/odom", Odometry, lambda m: received.append(m.header.stamp.seconds))
    while player.advance(0.01):
        continue
    assert (received[0], received[-1]) == pytest.approx((0.4, 0.6))
    with pytest.raises(KbotError, match="playback cannot start at 50 s"):
        Player(str(runs["mcap"]), start=50.0)
    with pytest.raises(KbotError, match="no topic /odmo"):
        Player(str(runs["mcap"]), topics=("/odmo",))


def test_late_subscribers_receive_latched_messages(tmp_path: Path) -> None:
    """Two nodes published a static transform each, like a robot and a static_transform_publisher."""
    bus, clock = Bus(), Clock()
    feed = Feed(bus, lambda: clock.nanoseconds)
    publisher = bus.advertise("/tf_static", TFMessage, latched=True)
    writer = open_writer(str(tmp_path / "run.mcap"))
    feed.open("/tf_static", writer.write)
    for child in ("camera", "laser"):
        publisher.publish(TFMessage((TransformStamped(Header(clock.stamp, "base"), child, Transform()),)))
    writer.close()
    player = Player(str(tmp_path / "run.mcap"))
    player.advance(0.0)
    received: list[TFMessage] = []
    player.bus.subscribe("/tf_static", TFMessage, received.append)
    assert [t.child_frame_id for t in received[-1].transforms] == ["camera", "laser"]


def test_play_publishes_to_kbot_topic(
    runs: dict[str, Path], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """`kbot bag play` in one process, `kbot topic` in another."""
    monkeypatch.setenv("XDG_RUNTIME_DIR", str(tmp_path))
    words = (sys.executable, "-m", "kbot")
    playing = subprocess.Popen((*words, "bag", "play", str(runs["mcap"]), "--loop"), stderr=subprocess.PIPE)
    try:
        end = time.monotonic() + 60
        while not list((tmp_path / "kbot").glob("*.json")):
            assert time.monotonic() < end, "it does not begin"
            time.sleep(0.05)
        clock = subprocess.run(
            (*words, "topic", "echo", "/clock", "-n", "3", "--json"),
            capture_output=True,
            text=True,
            timeout=60,
        )
        frames = subprocess.run((*words, "tf", "tree"), capture_output=True, text=True, timeout=60)
    finally:
        playing.send_signal(signal.SIGINT)
        _, output = playing.communicate(timeout=60)
    assert len([json.loads(line)["clock"] for line in clock.stdout.splitlines()]) == 3
    assert frames.stdout.startswith("odom\n  base_footprint\n")
    assert b"Traceback" not in output
    assert not list((tmp_path / "kbot").glob("*.json"))


def test_player_publishes_the_clock(runs: dict[str, Path]) -> None:
    """A recorded /clock is not published: the player publishes its own, even if none was recorded."""
    assert ClockMessage not in Player(str(runs["mcap"])).bus.topics.values()


def test_parquet_has_the_same_data_as_csv(runs: dict[str, Path], tmp_path: Path) -> None:
    target = tmp_path / "odom.parquet"
    words = ("bag", "export", str(runs["mcap"]), "--topic", "/odom", "--to", "parquet")
    assert run(words) == 2  # not text
    assert run((*words, "-o", str(target))) == 0
    table = pyarrow.parquet.read_table(target)
    last = [e for e in Recording(str(runs["mcap"])).entries() if e.topic == "/odom"][-1].message()
    assert table.column("pose.pose.position.x")[-1].as_py() == last.pose.pose.position.x
    assert table.column("child_frame_id")[0].as_py() == "base_footprint"
    assert table.column("time")[-1].as_py() == 1.52


@pytest.mark.skipif(os.name == "nt", reason="there are no such signals")
@pytest.mark.parametrize("number", [signal.SIGTERM, signal.SIGHUP])
def test_interrupted_run_leaves_a_complete_recording(tmp_path: Path, number: int) -> None:
    target = tmp_path / "run.mcap"
    words = ("sim", "kbot", "--headless", "--duration", "100000", "--record", str(target))
    running = subprocess.Popen((sys.executable, "-m", "kbot", *words), stderr=subprocess.PIPE, text=True)
    end = time.monotonic() + 60
    while not (target.exists() and target.stat().st_size > 300_000):
        assert time.monotonic() < end, "it does not record"
        time.sleep(0.05)
    running.send_signal(number)
    _, output = running.communicate(timeout=60)
    assert running.returncode == 128 + number
    summary = Recording(str(target)).summary()
    assert not summary.broken
    assert "kbot.end" in summary.notes
    assert f"{target}: {summary.count} messages recorded" in output
