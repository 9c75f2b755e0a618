"""Recordings contain all messages, and do not change the run."""

import gc
import re
import subprocess
import sys
import tracemalloc
from pathlib import Path

import mcap.reader
import pytest
from rosbags.rosbag1 import Writer

import kbot
from kbot.messages import Header, String, Time, Twist, Vector3
from kbot.messages.visualization import Marker, MarkerArray
from kbot.model.load import load_robot
from kbot.record import Recorder, Recording
from kbot.record.bags import ros1_writer
from kbot.record.copy import copy_recording
from kbot.record.encodings.serialization import decode_cdr
from kbot.record.feed import Feed, Packet
from kbot.record.formats import INDEX_BYTES
from kbot.record.writer import open_writer
from kbot.sim import Simulation
from kbot.text import KbotError

from .conftest import drive, record

TICKS = 76
"""Control periods of 20 ms in 0.5 + 0.712 + 0.014 + 0.3 s."""
SPOKEN = {"/clock", "/joint_states", "/odom", "/tf"}


def test_recording_does_not_change_the_run(tmp_path: Path) -> None:
    free = Simulation(kbot.load("kbot"), "boxes")
    drive(free)
    recorded, _ = record(tmp_path / "run.mcap")
    assert recorded.state_sha256() == free.state_sha256()


@pytest.mark.parametrize("kind", ["mcap", "bag", "ros2"])
def test_all_formats_contain_the_same_data(runs: dict[str, Path], kind: str) -> None:
    found = Recording(str(runs[kind])).summary()
    counts = {name: topic.count for name, topic in found.topics.items()}
    assert counts == {
        **dict.fromkeys(SPOKEN, TICKS),
        "/cmd_vel": 1,
        "/kbot/commands": 4,
        # also at the start, but not in the period in which the robot stands after the watchdog has stopped it
        "/kbot/poses": TICKS + 1 - 1,
        "/kbot/world": 1,
        "/robot_description": 1,
    }
    assert found.end == TICKS * 20_000_000
    assert found.notes["kbot"]["world"] == "boxes"
    assert found.notes["kbot.end"]["time"] == "1.526"
    assert not found.broken
    first = [e.cdr for e in Recording(str(runs["mcap"])).entries() if e.topic == "/odom"]
    assert [e.cdr for e in Recording(str(runs[kind])).entries() if e.topic == "/odom"] == first


def test_a_recording_that_is_never_finished_leaves_no_open_file(tmp_path: Path) -> None:
    """A warning of an open file would be an error of the test."""
    writer = open_writer(str(tmp_path / "run.mcap"))
    writer.annotate("x", {"a": "b"})
    del writer
    gc.collect()


@pytest.mark.parametrize("name", ["run.mcap", "run.bag"])
def test_memory_does_not_grow_with_the_recording(tmp_path: Path, name: str) -> None:
    """A recorder ends a chunk twice a second: 500 chunks are those of four minutes."""
    writer = open_writer(str(tmp_path / name))

    def write(chunks: range) -> int:
        for chunk in chunks:
            for topic in range(8):
                writer.write(Packet(f"/topic{topic}", String("data"), 500_000_000 * chunk + topic))
            writer.flush()
        return tracemalloc.get_traced_memory()[0]

    tracemalloc.start()
    try:
        early, late = write(range(50)), write(range(50, 550))
    finally:
        tracemalloc.stop()
    writer.close()
    # the index of the chunks is kept as bytes, and at most this many of them
    assert late - early < INDEX_BYTES + 10_000
    assert Recording(str(tmp_path / name)).summary().count == 550 * 8


def test_bag_has_the_bytes_that_the_rosbags_library_writes(tmp_path: Path) -> None:
    """Three chunks, of which one is empty and one has a topic of its own."""

    def write(path: Path) -> bytes:
        writer = open_writer(str(path))
        for chunk, topics in enumerate((("/a", "/b"), (), ("/c", "/a"))):
            for topic in topics:
                writer.write(Packet(topic, String(f"{chunk}"), 500_000_000 * chunk))
            writer.flush()
        writer.close()
        return path.read_bytes()

    own = write(tmp_path / "own.bag")
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(ros1_writer, "_Bag", type("_Bag", (Writer,), {}))
        assert own == write(tmp_path / "library.bag")


def test_official_reader_finds_times_schemas_and_metadata(runs: dict[str, Path]) -> None:
    with runs["mcap"].open("rb") as stream:
        reader = mcap.reader.make_reader(stream, validate_crcs=True)
        summary = reader.get_summary()
        assert reader.get_header().profile == "ros2"
        assert {schema.encoding for schema in summary.schemas.values()} == {"ros2msg"}
        times = [message.log_time for _, _, message in reader.iter_messages(["/odom"])]
        assert times == [tick * 20_000_000 for tick in range(1, TICKS + 1)]
        last = list(reader.iter_messages(["/odom"]))[-1][2]
        notes = {item.name: item.metadata for item in reader.iter_metadata()}
    odometry = decode_cdr(last.data, kbot.messages.Odometry)
    assert odometry.header.stamp.nanoseconds == last.log_time
    assert notes["kbot"]["robot"] == "kbot"


def test_only_selected_topics_are_recorded(tmp_path: Path) -> None:
    record(tmp_path / "run.mcap", topics=["odom"])
    topics = Recording(str(tmp_path / "run.mcap")).summary().topics
    assert set(topics) == {"/odom", "/kbot/commands", "/robot_description"}


def test_unknown_topic_is_refused_before_a_file_is_created(tmp_path: Path) -> None:
    with pytest.raises(KbotError, match=r"cannot record /odm: .*odom"):
        record(tmp_path / "run.mcap", topics=["/odm"])
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize(
    ("name", "message"),
    [
        ("run.csv", "unknown recording format '.csv'"),
        ("there.mcap", "already exists"),
        ("no/such/folder/run.mcap", "cannot be written: No such file"),
        ("no/such/folder/run.bag", "cannot be written: No such file"),
    ],
)
def test_file_that_cannot_be_created_is_one_error(tmp_path: Path, name: str, message: str) -> None:
    (tmp_path / "there.mcap").write_text("mine")
    with pytest.raises(KbotError, match=message):
        record(tmp_path / name)
    assert (tmp_path / "there.mcap").read_text() == "mine"


def test_topic_that_appears_later_is_recorded(tmp_path: Path) -> None:
    def late(sim: Simulation) -> None:
        sim.run(1.0)
        publisher = sim.bus.advertise("/late", kbot.messages.String)
        sim.run(1.0)
        publisher.publish(kbot.messages.String("received"))

    record(tmp_path / "run.mcap", late)
    assert Recording(str(tmp_path / "run.mcap")).summary().topics["/late"].count == 1


def test_is_recording_does_not_import_the_readers() -> None:
    """KBot calls it for every file that it shows, before the browser opens."""
    code = (
        "import sys\nfrom kbot.record.names import is_recording\n"
        "assert not is_recording('robot.xacro') and is_recording('run.mcap')\n"
        "sys.exit(', '.join({'numpy', 'rosbags', 'mcap', 'kbot.record.reader'} & sys.modules.keys()) or 0)"
    )
    subprocess.run([sys.executable, "-c", code], check=True, timeout=60)


def test_folder_that_is_not_a_recording_is_refused_with_the_reason(tmp_path: Path) -> None:
    (tmp_path / "empty").mkdir()
    with pytest.raises(KbotError, match=r"empty is not a rosbag2 folder: it has no metadata\.yaml$"):
        Recording(str(tmp_path / "empty")).summary()


@pytest.mark.parametrize("mark", ["#", "%", "?"])
def test_folder_name_that_sqlite_does_not_accept_is_refused(tmp_path: Path, mark: str) -> None:
    with pytest.raises(
        KbotError,
        match=f"cannot be written: the name of a rosbag2 folder cannot contain {re.escape(mark)}",
    ):
        record(tmp_path / f"run {mark}1")
    assert list(tmp_path.iterdir()) == []


def test_recording_continues_if_the_working_directory_changes(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    sim = Simulation(kbot.load("kbot"))
    with Recorder(sim, Feed(sim.bus, lambda: sim.clock.nanoseconds), "run.mcap") as recorder:
        monkeypatch.chdir("/")
        sim.run(0.2)
    assert recorder.failure is None
    assert Recording(str(tmp_path / "run.mcap")).summary().topics["/odom"].count == 10


def test_closed_recorder_does_not_touch_the_simulation(tmp_path: Path) -> None:
    sim, recorder = record(tmp_path / "run.mcap")
    size = (tmp_path / "run.mcap").stat().st_size
    sim.cmd_vel(0.1, 0.0)
    sim.run(1.0)
    recorder.close()
    assert sim.journal.write is None
    assert (tmp_path / "run.mcap").stat().st_size == size


def test_no_file_remains_open(tmp_path: Path) -> None:
    open_files = Path("/proc/self/fd")
    if not open_files.is_dir():
        pytest.skip("only Linux tells which files are open")
    before = len(list(open_files.iterdir()))
    for number in range(3):
        record(tmp_path / f"{number}.mcap")
    assert len(list(open_files.iterdir())) == before


def test_messages_with_fewer_fields_in_ros_1_are_the_same_in_every_format(tmp_path: Path) -> None:
    """visualization_msgs/Marker has textures and mesh files only in ROS 2."""
    marker = Marker(Header(Time(1, 2), "map"), "ns", 3, 1, text="here", mesh_resource="package://a/b.stl")
    sim = Simulation(kbot.load("kbot"))
    publisher = sim.bus.advertise("/markers", MarkerArray)
    with Recorder(sim, Feed(sim.bus, lambda: sim.clock.nanoseconds), str(tmp_path / "a.bag")):
        sim.run(0.3)
        publisher.publish(MarkerArray((marker,)))
    for source, target in (("a.bag", "b.mcap"), ("b.mcap", "c.bag"), ("c.bag", "d")):
        copy_recording(str(tmp_path / source), str(tmp_path / target))
    for name in ("a.bag", "b.mcap", "c.bag", "d"):
        entries = Recording(str(tmp_path / name)).entries()
        (found,) = (entry.message() for entry in entries if entry.topic == "/markers")
        assert (found.markers[0].ns, found.markers[0].text) == ("ns", "here")
        assert found.markers[0].mesh_resource == "package://a/b.stl"


def test_diverged_run_is_not_recorded(tmp_path: Path) -> None:
    simulation = Simulation(load_robot("kbot").require())
    simulation.engine.data.qpos[0] = 1e16
    simulation.engine.mark_moved()
    with pytest.raises(KbotError, match="the run has diverged: reset it first"):
        Recorder(simulation, Feed(simulation.bus, lambda: 0), str(tmp_path / "run.mcap"))
    assert not list(tmp_path.iterdir())


def test_recording_that_fails_at_its_start_leaves_no_file(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def broken(*_: object) -> None:
        raise ValueError("a bug")

    simulation = Simulation(load_robot("kbot").require())
    monkeypatch.setattr("kbot.record.recorder.WorldRecorder", broken)
    with pytest.raises(ValueError, match="a bug"):
        Recorder(simulation, Feed(simulation.bus, lambda: 0), str(tmp_path / "run.mcap"))
    assert not list(tmp_path.iterdir())
    assert simulation.journal.write is None


def test_command_that_cannot_be_recorded_is_refused_to_its_sender(tmp_path: Path) -> None:
    sim = Simulation(kbot.load("kbot"))
    with Recorder(sim, Feed(sim.bus, lambda: sim.clock.nanoseconds), str(tmp_path / "run.bag")) as recorder:
        sim.run(0.1)
        with pytest.raises(KbotError, match=r"Twist\.linear\.y must be a number, not str 'far'"):
            sim.bus.publish("/cmd_vel", Twist(Vector3(0.1, "far")))  # type: ignore[arg-type]
        sim.run(0.1)
    assert recorder.failure is None


def test_invalid_message_is_refused_and_the_others_are_recorded(tmp_path: Path) -> None:
    sim = Simulation(kbot.load("kbot"))
    talk = sim.bus.advertise("/talk", String)
    path = str(tmp_path / "run.mcap")
    recorder = Recorder(sim, Feed(sim.bus, lambda: sim.clock.nanoseconds), path, topics=["/talk"])
    for text in ("before", "\ud800", "after"):  # half of a character
        talk.publish(String(text))
    with pytest.raises(KbotError, match="/talk: a message cannot be recorded: not a std_msgs/msg/String"):
        recorder.close()
    texts = [entry.message().data for entry in Recording(path).entries() if entry.topic == "/talk"]
    assert texts == ["before", "after"]
    assert not Recording(path).summary().broken
