"""Recordings hold all that was said, and change nothing in the run."""

import re
import subprocess
import sys
from pathlib import Path

import mcap.reader
import pytest

import kbot
from kbot.messages import Header, String, Time, Twist, Vector3
from kbot.messages.visualization import Marker, MarkerArray
from kbot.model.load import load_robot
from kbot.record import Recorder, Recording
from kbot.record.copy import copy_recording
from kbot.record.encodings.serialization import decode_cdr
from kbot.record.feed import Feed
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
def test_all_formats_hold_the_same(runs: dict[str, Path], kind: str) -> None:
    found = Recording(str(runs[kind])).summary()
    counts = {name: topic.count for name, topic in found.topics.items()}
    assert counts == {
        **dict.fromkeys(SPOKEN, TICKS),
        "/cmd_vel": 1,
        "/kbot/commands": 4,
        "/kbot/poses": TICKS + 1,  # at the start too
        "/kbot/world": 1,
        "/robot_description": 1,
    }
    assert found.end == TICKS * 20_000_000
    assert found.notes["kbot"]["world"] == "boxes"
    assert found.notes["kbot.end"]["time"] == "1.526"
    assert not found.broken
    first = [e.cdr for e in Recording(str(runs["mcap"])).entries() if e.topic == "/odom"]
    assert [e.cdr for e in Recording(str(runs[kind])).entries() if e.topic == "/odom"] == first


def test_the_official_reader_finds_times_schemas_and_metadata(runs: dict[str, Path]) -> None:
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


def test_only_chosen_topics(tmp_path: Path) -> None:
    record(tmp_path / "run.mcap", topics=["odom"])
    topics = Recording(str(tmp_path / "run.mcap")).summary().topics
    assert set(topics) == {"/odom", "/kbot/commands", "/robot_description"}


def test_an_unknown_topic_is_refused_before_a_file_is_made(tmp_path: Path) -> None:
    with pytest.raises(KbotError, match=r"cannot record /odm: .*odom"):
        record(tmp_path / "run.mcap", topics=["/odm"])
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize(
    ("name", "said"),
    [
        ("run.csv", "unknown recording format '.csv'"),
        ("there.mcap", "already exists"),
        ("no/such/folder/run.mcap", "cannot be written: No such file"),
        ("no/such/folder/run.bag", "cannot be written: No such file"),
    ],
)
def test_a_file_that_cannot_be_made_is_one_clear_error(tmp_path: Path, name: str, said: str) -> None:
    (tmp_path / "there.mcap").write_text("mine")
    with pytest.raises(KbotError, match=said):
        record(tmp_path / name)
    assert (tmp_path / "there.mcap").read_text() == "mine"


def test_a_topic_that_comes_up_later_is_recorded_too(tmp_path: Path) -> None:
    def late(sim: Simulation) -> None:
        sim.run(1.0)
        publisher = sim.bus.advertise("/late", kbot.messages.String)
        sim.run(1.0)
        publisher.publish(kbot.messages.String("heard"))

    record(tmp_path / "run.mcap", late)
    assert Recording(str(tmp_path / "run.mcap")).summary().topics["/late"].count == 1


def test_whether_a_file_is_a_recording_is_asked_without_what_reads_one() -> None:
    """It is asked of every file that is shown, before the browser opens."""
    code = (
        "import sys\nfrom kbot.record.names import is_recording\n"
        "assert not is_recording('robot.xacro') and is_recording('run.mcap')\n"
        "sys.exit(', '.join({'numpy', 'rosbags', 'mcap', 'kbot.record.reader'} & sys.modules.keys()) or 0)"
    )
    subprocess.run([sys.executable, "-c", code], check=True, timeout=60)


def test_a_folder_that_is_no_recording_is_told_what_is_missing(tmp_path: Path) -> None:
    (tmp_path / "empty").mkdir()
    with pytest.raises(KbotError, match=r"empty is not a rosbag2 folder: it has no metadata\.yaml$"):
        Recording(str(tmp_path / "empty")).summary()


@pytest.mark.parametrize("mark", ["#", "%", "?"])
def test_a_folder_that_rosbag2_could_not_find_again_is_not_made(tmp_path: Path, mark: str) -> None:
    with pytest.raises(
        KbotError,
        match=f"cannot be written: the name of a rosbag2 folder cannot contain {re.escape(mark)}",
    ):
        record(tmp_path / f"run {mark}1")
    assert list(tmp_path.iterdir()) == []


def test_a_recording_goes_on_where_the_program_goes_elsewhere(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    sim = Simulation(kbot.load("kbot"))
    with Recorder(sim, Feed(sim.bus, lambda: sim.clock.nanoseconds), "run.mcap") as recorder:
        monkeypatch.chdir("/")
        sim.run(0.2)
    assert recorder.failure is None
    assert Recording(str(tmp_path / "run.mcap")).summary().topics["/odom"].count == 10


def test_a_simulation_that_is_closed_is_left_alone(tmp_path: Path) -> None:
    sim, recorder = record(tmp_path / "run.mcap")
    size = (tmp_path / "run.mcap").stat().st_size
    sim.cmd_vel(0.1, 0.0)
    sim.run(1.0)
    recorder.close()
    assert sim.journal.write is None
    assert (tmp_path / "run.mcap").stat().st_size == size


def test_nothing_is_left_open(tmp_path: Path) -> None:
    open_files = Path("/proc/self/fd")
    if not open_files.is_dir():
        pytest.skip("only Linux tells which files are open")
    before = len(list(open_files.iterdir()))
    for number in range(3):
        record(tmp_path / f"{number}.mcap")
    assert len(list(open_files.iterdir())) == before


def test_messages_that_ros_1_has_with_fewer_fields_are_the_same_in_every_format(tmp_path: Path) -> None:
    """visualization_msgs/Marker of ROS 2 has textures and mesh files too."""
    marker = Marker(Header(Time(1, 2), "map"), "ns", 3, 1, text="here", mesh_resource="package://a/b.stl")
    sim = Simulation(kbot.load("kbot"))
    said = sim.bus.advertise("/markers", MarkerArray)
    with Recorder(sim, Feed(sim.bus, lambda: sim.clock.nanoseconds), str(tmp_path / "a.bag")):
        sim.run(0.3)
        said.publish(MarkerArray((marker,)))
    for source, target in (("a.bag", "b.mcap"), ("b.mcap", "c.bag"), ("c.bag", "d")):
        copy_recording(str(tmp_path / source), str(tmp_path / target))
    for name in ("a.bag", "b.mcap", "c.bag", "d"):
        entries = Recording(str(tmp_path / name)).entries()
        (found,) = (entry.message() for entry in entries if entry.topic == "/markers")
        assert (found.markers[0].ns, found.markers[0].text) == ("ns", "here")
        assert found.markers[0].mesh_resource == "package://a/b.stl"


def test_a_run_that_diverged_is_not_recorded(tmp_path: Path) -> None:
    simulation = Simulation(load_robot("kbot").require())
    simulation.engine.data.qpos[0] = 1e16
    simulation.engine.mark_moved()
    with pytest.raises(KbotError, match="the run has diverged: reset it first"):
        Recorder(simulation, Feed(simulation.bus, lambda: 0), str(tmp_path / "run.mcap"))
    assert not list(tmp_path.iterdir())


def test_a_recording_that_fails_as_it_begins_leaves_nothing(
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


def test_a_command_that_cannot_be_recorded_is_refused_where_it_is_given(tmp_path: Path) -> None:
    sim = Simulation(kbot.load("kbot"))
    with Recorder(sim, Feed(sim.bus, lambda: sim.clock.nanoseconds), str(tmp_path / "run.bag")) as recorder:
        sim.run(0.1)
        with pytest.raises(
            KbotError, match="/cmd_vel: a message cannot be recorded: not a geometry_msgs/msg"
        ):
            sim.bus.publish("/cmd_vel", Twist(Vector3(0.1, "far")))  # type: ignore[arg-type]
        sim.run(0.1)
    assert recorder.failure is None


def test_a_message_that_is_none_is_refused_and_the_others_are_recorded(tmp_path: Path) -> None:
    sim = Simulation(kbot.load("kbot"))
    talk = sim.bus.advertise("/talk", String)
    path = str(tmp_path / "run.mcap")
    recorder = Recorder(sim, Feed(sim.bus, lambda: sim.clock.nanoseconds), path, topics=["/talk"])
    for text in ("before", 5, "after"):
        talk.publish(String(text))  # type: ignore[arg-type] - what a program may do
    with pytest.raises(KbotError, match="/talk: a message cannot be recorded: not a std_msgs/msg/String"):
        recorder.close()
    said = [entry.message().data for entry in Recording(path).entries() if entry.topic == "/talk"]
    assert said == ["before", "after"]
    assert not Recording(path).summary().broken
