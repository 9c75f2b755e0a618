"""Incomplete bags: their readable messages, and what is reported."""

import os
import signal
import sqlite3
import subprocess
import sys
import time
from contextlib import closing
from pathlib import Path

import pytest
from rosbags.rosbag1 import Writer
from rosbags.typesys import Stores, get_typestore

import kbot
from kbot.record import Recorder, Recording
from kbot.record.copy import copy_recording
from kbot.record.feed import Feed
from kbot.record.index import open_index
from kbot.record.names import is_recording
from kbot.sim import Simulation
from kbot.text import KbotError

COUNT = 300
NO_INDEX = b"index_pos="


@pytest.fixture(scope="module", params=["none", "bz2", "lz4"])
def whole(request, tmp_path_factory) -> bytes:
    """Numbers 0 to 299, one per millisecond, in chunks of about forty messages."""
    path = tmp_path_factory.mktemp("bags") / "numbers.bag"
    store = get_typestore(Stores.ROS1_NOETIC)
    number = store.types["std_msgs/msg/UInt32"]
    writer = Writer(path)
    if request.param != "none":
        writer.set_compression(Writer.CompressionFormat[request.param.upper()])
    writer.chunk_threshold = 2000
    with writer:
        topics = [writer.add_connection(name, number.__msgtype__, typestore=store) for name in ("/a", "/b")]
        for n in range(COUNT):
            data = store.serialize_ros1(number(data=n), number.__msgtype__)
            writer.write(topics[n % 2], (n + 1) * 1_000_000, data)
    return path.read_bytes()


def test_first_messages_of_a_truncated_bag_are_read(whole: bytes, tmp_path: Path) -> None:
    at = whole.index(NO_INDEX) + len(NO_INDEX)
    index = int.from_bytes(whole[at : at + 8], "little")
    file = tmp_path / "cut.bag"
    counts = []
    for size in (4200, 5000, *range(6000, index, 1777), index):
        file.write_bytes(whole[:size])
        entries = list(Recording(str(file)).entries())
        assert [entry.message().data for entry in entries] == list(range(len(entries)))
        assert [entry.nanoseconds for entry in entries] == [(n + 1) * 1_000_000 for n in range(len(entries))]
        counts.append(len(entries))
    assert counts == sorted(counts)
    assert counts[-1] == COUNT


def test_incomplete_bag_is_reported_and_its_copy_is_complete(whole: bytes, tmp_path: Path) -> None:
    broken, repaired = tmp_path / "broken.bag.active", tmp_path / "repaired.bag"
    at = whole.index(NO_INDEX) + len(NO_INDEX)
    index = int.from_bytes(whole[at : at + 8], "little")
    broken.write_bytes(whole[:at] + bytes(8) + whole[at + 8 : index])
    copied = copy_recording(str(broken), str(repaired))
    assert copied.messages == COUNT
    assert copied.broken == f"it was not closed, so its {index:,} bytes have no index"
    found = Recording(str(repaired)).summary()
    assert (found.count, found.broken) == (COUNT, "")
    shown = open_index(str(broken))
    newest = shown.newest("/a", 10_000_000)
    assert newest is not None
    assert newest.message().data == 8


@pytest.mark.parametrize(("name", "grown"), [("run.bag", "run.bag"), ("run", "run/run.db3")])
def test_killed_kbot_loses_only_the_last_second(tmp_path: Path, name: str, grown: str) -> None:
    file, grows = tmp_path / name, tmp_path / grown
    code = (
        "import kbot, sys, time\nfrom kbot.record import Feed, Recorder\n"
        "sim = kbot.Simulation(kbot.load('kbot'))\n"
        f"recorder = Recorder(sim, Feed(sim.bus, lambda: sim.clock.nanoseconds), {str(file)!r})\n"
        "while True: sim.run(0.1); time.sleep(0.05)\n"
    )
    process = subprocess.Popen([sys.executable, "-c", code])
    try:
        end = time.monotonic() + 60.0
        # the last messages may not be committed yet: record more than one second before them
        while not (grows.exists() and grows.stat().st_size > 250_000):
            assert time.monotonic() < end
            time.sleep(0.1)
    finally:
        os.kill(process.pid, getattr(signal, "SIGKILL", signal.SIGTERM))
        process.wait(60)
    found = Recording(str(file)).summary()
    assert "it was not closed" in found.broken
    assert found.topics["/odom"].count > 10
    assert "kbot" in found.notes
    copied = copy_recording(str(file), str(tmp_path / "whole.mcap"))
    assert copied.messages == found.count
    assert open_index(str(file)).newest("/odom", 500_000_000) is not None


def test_folder_is_read_without_metadata_and_during_writing(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("kbot.record.bags.sqlite_file.AT_ONCE", 7)
    folder = tmp_path / "run"
    sim = Simulation(kbot.load("kbot"))
    recorder = Recorder(sim, Feed(sim.bus, lambda: sim.clock.nanoseconds), str(folder))
    sim.run(1.0)
    recorder.flush()
    entries = Recording(str(folder)).entries()
    first = next(entries)
    sim.run(1.0)
    recorder.close()  # a reader does not block the writer
    (folder / "metadata.yaml").unlink()
    late = list(entries)
    found = Recording(str(folder)).summary()
    assert found.broken == "it was not closed, so it has no metadata.yaml"
    assert found.topics["/odom"].count == 100
    assert is_recording(str(folder))
    times = [entry.nanoseconds for entry in [first, *late] if entry.topic == "/odom"]
    assert times == [tick * 20_000_000 for tick in range(1, 101)]


def test_damaged_file_of_a_folder_is_read_up_to_the_damage(tmp_path: Path) -> None:
    folder = tmp_path / "run"
    sim = Simulation(kbot.load("kbot"))
    with Recorder(sim, Feed(sim.bus, lambda: sim.clock.nanoseconds), str(folder)):
        sim.run(2.0)
    (folder / "metadata.yaml").unlink()
    data = bytearray((folder / "run.db3").read_bytes())
    middle = len(data) // 2
    data[middle : middle + 40_000] = b"\xff" * 40_000
    (folder / "run.db3").write_bytes(data)
    found = Recording(str(folder)).summary()
    assert 0 < found.topics["/odom"].count < 100
    assert "run.db3 cannot be read: database disk image is malformed" in found.broken


def test_reading_ends_at_garbage_after_complete_messages(whole: bytes, tmp_path: Path) -> None:
    at = whole.index(NO_INDEX) + len(NO_INDEX)
    file = tmp_path / "garbage.bag"
    file.write_bytes(whole[:at] + bytes(8) + whole[at + 8 : 9000] + b"\xff" * 500)
    found = Recording(str(file)).summary()
    assert 0 < found.count < COUNT
    assert found.broken


def test_flushed_messages_are_in_the_file(tmp_path: Path) -> None:
    file = tmp_path / "run.bag"
    sim = Simulation(kbot.load("kbot"))
    recorder = Recorder(sim, Feed(sim.bus, lambda: sim.clock.nanoseconds), str(file))
    sim.run(1.0)
    recorder.flush()
    assert Recording(str(file)).summary().topics["/odom"].count == 50
    recorder.close()
    assert Recording(str(file)).summary().broken == ""


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ("messages SET data='text' WHERE id=5", "contains str, not bytes"),
        ("messages SET data=1000000000000 WHERE id=5", "contains int, not bytes"),
        ("messages SET timestamp='noon' WHERE id=5", "the invalid time 'noon'"),
        ("messages SET timestamp=-1 WHERE id=5", "the invalid time -1"),
    ],
)
@pytest.mark.parametrize("is_closed", [True, False])
def test_folder_with_wrong_column_types_is_reported(
    tmp_path: Path, change: str, words: str, is_closed: bool
) -> None:
    folder = tmp_path / "run"
    sim = Simulation("kbot")
    with Recorder(sim, Feed(sim.bus, lambda: sim.clock.nanoseconds), str(folder)):
        sim.run(0.1)
    with closing(sqlite3.connect(next(folder.glob("*.db3")))) as database, database:
        database.execute(f"UPDATE {change}")
    if is_closed:
        with pytest.raises(KbotError, match=f"cannot be read as rosbag2: .*{words}"):
            Recording(str(folder)).summary()
    else:
        (folder / "metadata.yaml").unlink()
        found = Recording(str(folder)).summary()
        assert words in found.broken
        assert found.count == 4 - len(found.notes)


def test_mcap_parts_without_metadata_are_one_recording(tmp_path: Path) -> None:
    folder = tmp_path / "run"
    folder.mkdir()
    sim = Simulation(kbot.load("kbot"))
    for number in (0, 1):
        part = str(folder / f"run_{number}.mcap")
        with Recorder(sim, Feed(sim.bus, lambda: sim.clock.nanoseconds), part, topics=["/odom"]):
            sim.run(1.0)
    found = Recording(str(folder)).summary()
    assert found.topics["/odom"].count == 100
    assert open_index(str(folder)).newest("/odom", 1_500_000_000) is not None
    (folder / "run_1.mcap").rename(folder / "other_1.mcap")
    with pytest.raises(KbotError, match=r"has no metadata\.yaml; you can read a file in it"):
        Recording(str(folder)).summary()


@pytest.mark.parametrize("name", ["a.mcap", "a.bag", "a/run.db3"])
def test_a_pointer_of_git_lfs_is_named(tmp_path: Path, name: str) -> None:
    file = tmp_path / name
    file.parent.mkdir(exist_ok=True)
    file.write_text("version https://git-lfs.github.com/spec/v1\noid sha256:4d7a\nsize 12345\n")
    path = file.parent if name.endswith("db3") else file
    with pytest.raises(KbotError, match="only a pointer of Git LFS"):
        Recording(str(path)).summary()
