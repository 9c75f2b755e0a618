"""Recordings hold all that was said, change nothing in the run, and survive what can go wrong."""

import os
import random
import re
import resource
import shutil
import signal
import sqlite3
import subprocess
import sys
import textwrap
from pathlib import Path

import mcap.reader
import pytest

import kbot
from kbot.messages import Header, String, Time, Twist, Vector3
from kbot.messages.visualization import Marker, MarkerArray
from kbot.model.load import load_robot
from kbot.record import Recorder, Recording
from kbot.record.copy import copy_recording
from kbot.sim import Simulation
from kbot.text import KbotError
from kbot.wire import Feed, decode_cdr

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
    with pytest.raises(KbotError, match=r"no topic /odm to record.*odom"):
        record(tmp_path / "run.mcap", topics=["/odm"])
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize(
    ("name", "said"),
    [
        ("run.csv", "'.csv' is no kind of recording"),
        ("there.mcap", "is there already"),
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


def test_a_full_disk_ends_the_recording_and_not_the_run(tmp_path: Path) -> None:
    """The limit on a file's size stands in for the disk's."""
    program = f"""
        import resource, signal
        signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
        resource.setrlimit(resource.RLIMIT_FSIZE, (60_000, 60_000))
        import kbot
        from kbot.record import Recorder
        from kbot.sim import Simulation
        from kbot.wire import Feed
        told = []
        sim = Simulation(kbot.load("kbot"))
        feed = Feed(sim.bus, lambda: sim.clock.nanoseconds)
        recorder = Recorder(sim, feed, {str(tmp_path / "run.mcap")!r}, compress=False, on_failure=told.append)
        sim.cmd_vel(0.3, 0.4)
        for _ in range(20):
            sim.run(0.5)
            recorder.flush()
        recorder.close()
        assert told == [recorder.failure], told
        print(sim.time, recorder.failure)
    """
    done = subprocess.run(
        [sys.executable, "-c", textwrap.dedent(program)], capture_output=True, text=True, check=True
    )
    assert done.stdout.startswith("10.0 ")
    assert "File too large; the recording ended at" in done.stdout
    kept = Recording(str(tmp_path / "run.mcap")).summary()
    assert kept.broken
    assert f"{kept.count} messages up to {kept.end * 1e-9:.2f} s can be read" in done.stdout
    assert kept.topics["/odom"].count >= 25


@pytest.mark.skipif(os.name == "nt", reason="kills by signal")
@pytest.mark.parametrize(
    ("bytes_free", "said"), [(4096, "cannot be written: disk I/O error"), (60_000, "the recording ended at")]
)
def test_a_full_disk_is_told_of_by_sqlite_too(tmp_path: Path, bytes_free: int, said: str) -> None:
    """Where it cannot begin, and where it cannot go on."""
    program = f"""
        import resource, signal, sys
        from kbot.cli.main import run
        signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
        resource.setrlimit(resource.RLIMIT_FSIZE, ({bytes_free}, {bytes_free}))
        sys.exit(run(["sim", "kbot", "--headless", "--record", {str(tmp_path / "run")!r}]))
    """
    done = subprocess.run(
        [sys.executable, "-c", textwrap.dedent(program)], capture_output=True, text=True, check=False
    )
    assert done.returncode == 2
    assert said in done.stderr
    assert "Traceback" not in done.stderr
    assert (tmp_path / "run").exists() == (bytes_free == 60_000)


@pytest.mark.skipif(os.name == "nt", reason="kills by signal")
@pytest.mark.parametrize("name", ["run.mcap", "run.bag", "run"])
def test_a_recording_that_cannot_begin_is_not_in_the_way_of_the_next(tmp_path: Path, name: str) -> None:
    program = f"""
        import resource, signal, sys
        from kbot.cli.main import run
        signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
        words = ["sim", "kbot", "--headless", "--duration", "0.1", "--record", {str(tmp_path / name)!r}]
        resource.setrlimit(resource.RLIMIT_FSIZE, (0, resource.RLIM_INFINITY))
        first = run(words)
        resource.setrlimit(resource.RLIMIT_FSIZE, (resource.RLIM_INFINITY, resource.RLIM_INFINITY))
        print(first, run(words), file=sys.stderr)
    """
    with (tmp_path / "said").open("w") as out:
        done = subprocess.run(
            [sys.executable, "-c", textwrap.dedent(program)], stdout=out, stderr=subprocess.PIPE, text=True,
            check=True,
        )  # fmt: skip
    assert done.stderr.endswith("2 0\n"), done.stderr


@pytest.mark.skipif(os.name == "nt", reason="kills by signal")
def test_what_sqlite_has_recorded_a_second_before_the_disk_is_full_is_kept(tmp_path: Path) -> None:
    program = f"""
        import resource, signal, sys
        from kbot.cli.main import run
        signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
        resource.setrlimit(resource.RLIMIT_FSIZE, (1_000_000, 1_000_000))
        words = ["sim", "kbot", "--headless", "--duration", "60"]
        sys.exit(run([*words, "--record", {str(tmp_path / "run")!r}]))
    """
    done = subprocess.run(
        [sys.executable, "-c", textwrap.dedent(program)], capture_output=True, text=True, check=False
    )
    ended = float(done.stderr.split("the recording ended at ")[1].split(" s")[0])
    with sqlite3.connect(tmp_path / "run" / "run.db3") as base:
        (last,) = base.execute("SELECT max(timestamp) FROM messages").fetchone()
    assert ended > 2.0
    assert ended - 1.1 <= last * 1e-9 <= ended


def test_a_killed_run_is_readable_to_its_last_chunk(tmp_path: Path) -> None:
    program = f"""
        import os, kbot
        from kbot.record import Recorder
        from kbot.sim import Simulation
        from kbot.wire import Feed
        sim = Simulation(kbot.load("kbot"))
        feed = Feed(sim.bus, lambda: sim.clock.nanoseconds)
        recorder = Recorder(sim, feed, {str(tmp_path / "run.mcap")!r})
        sim.cmd_vel(0.3, 0.4)
        sim.run(30.0)
        os.kill(os.getpid(), {signal.SIGKILL.value})
    """
    done = subprocess.run([sys.executable, "-c", textwrap.dedent(program)], check=False)
    assert done.returncode == -signal.SIGKILL
    found = Recording(str(tmp_path / "run.mcap")).summary()
    assert "not closed" in found.broken
    assert found.notes["kbot"]["robot"] == "kbot"
    assert found.topics["/odom"].count > 1000


def test_any_cut_of_the_file_reads_up_to_there(runs: dict[str, Path], tmp_path: Path) -> None:
    """It has two chunks: the description's, and that of the run."""
    data = runs["mcap"].read_bytes()
    whole = Recording(str(runs["mcap"])).summary().count
    counts = []
    for length in range(200, len(data), 997):
        (tmp_path / "cut.mcap").write_bytes(data[:length])
        found = Recording(str(tmp_path / "cut.mcap")).summary()
        assert found.broken
        counts.append(found.count)
    assert sorted(counts) == counts
    assert set(counts) == {0, 1, whole}


def test_a_wrong_byte_in_a_chunk_loses_that_chunk_alone(runs: dict[str, Path], tmp_path: Path) -> None:
    """The first chunk holds the description, and the definitions of what the second one has."""
    data = bytearray(runs["mcap"].read_bytes())
    with runs["mcap"].open("rb") as stream:
        first, second = (index for index in mcap.reader.make_reader(stream).get_summary().chunk_indexes)
    whole = Recording(str(runs["mcap"])).summary()
    file = tmp_path / "wrong.mcap"
    for index, count in ((first, whole.count - 1), (second, 1)):
        at = index.chunk_start_offset + index.chunk_length - 10
        data[at] ^= 1
        file.write_bytes(data)
        data[at] ^= 1
        found = Recording(str(file)).summary()
        assert found.broken == "it is damaged: 1 of its 2 chunks cannot be read"
        assert found.count == count
        assert found.notes == whole.notes


@pytest.mark.parametrize("length", [0, 3, 12])
def test_a_file_that_ends_in_its_first_bytes_is_no_recording(tmp_path: Path, length: int) -> None:
    (tmp_path / "cut.mcap").write_bytes((b"\x89MCAP0\r\n\x01" + bytes([90]) * 20)[:length])
    with pytest.raises(KbotError, match="is no MCAP file: it ends before its first record"):
        Recording(str(tmp_path / "cut.mcap")).summary()


def test_a_bag_with_wrong_bytes_in_it_is_read_or_refused_in_words(
    tmp_path: Path, runs: dict[str, Path]
) -> None:
    good = runs["bag"].read_bytes()
    dice, refused = random.Random(1), 0
    for _ in range(30):
        bad = bytearray(good)
        for _ in range(40):
            bad[dice.randrange(20, len(bad))] = dice.randrange(256)
        (tmp_path / "bad.bag").write_bytes(bad)
        try:
            Recording(str(tmp_path / "bad.bag")).summary()
        except KbotError as error:
            refused += "bad.bag cannot be read as bag of ROS 1: " in str(error)
    assert refused > 20


def test_a_bag_that_was_cut_off_is_told_from_one_that_was_never_closed(
    tmp_path: Path, runs: dict[str, Path]
) -> None:
    """`index_pos` of the bag's header is where the index begins; 0 until it is written."""
    whole = runs["bag"].read_bytes()
    at = whole.index(b"index_pos=") + len(b"index_pos=")
    index = int.from_bytes(whole[at : at + 8], "little")
    file = tmp_path / "cut.bag"
    for data, said in (
        (whole[:9000], f"it ends after 9,000 bytes, before its index at {index:,}"),
        (whole[:at] + bytes(8) + whole[at + 8 :], f"it was not closed, so that its {len(whole):,} bytes"),
    ):
        file.write_bytes(data)
        assert said in Recording(str(file)).summary().broken


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
    with pytest.raises(KbotError, match=r"empty has no metadata\.yaml, as a folder of rosbag2 has$"):
        Recording(str(tmp_path / "empty")).summary()


@pytest.mark.parametrize("mark", ["#", "%", "?"])
def test_a_folder_that_rosbag2_could_not_find_again_is_not_made(tmp_path: Path, mark: str) -> None:
    with pytest.raises(KbotError, match=f"cannot be written: SQLite takes no {re.escape(mark)} in the name"):
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


@pytest.mark.parametrize("name", ["run.mcap", "run.bag", "run"])
def test_what_is_taken_away_while_it_is_recorded_is_told(tmp_path: Path, name: str) -> None:
    folder = tmp_path / "stick"
    folder.mkdir()
    sim = Simulation(kbot.load("kbot"))
    told: list[KbotError] = []
    recorder = Recorder(
        sim, Feed(sim.bus, lambda: sim.clock.nanoseconds), str(folder / name), on_failure=told.append
    )
    sim.run(0.5)
    shutil.rmtree(folder)
    sim.run(0.5)
    recorder.close()
    assert sim.time == 1.0
    assert [recorder.failure] == told
    assert "the recording ended at" in str(told[0])
    assert str(told[0]).endswith(f"nothing of it can be read: {folder / name} does not exist")


def test_a_simulation_that_is_closed_is_left_alone(tmp_path: Path) -> None:
    sim, recorder = record(tmp_path / "run.mcap")
    size = (tmp_path / "run.mcap").stat().st_size
    sim.cmd_vel(0.1, 0.0)
    sim.run(1.0)
    recorder.close()
    assert sim.journal is None
    assert (tmp_path / "run.mcap").stat().st_size == size


def test_nothing_is_left_open(tmp_path: Path) -> None:
    open_files = Path("/proc/self/fd")
    if not open_files.is_dir():
        pytest.skip("only Linux tells which files are open")
    before = len(list(open_files.iterdir()))
    for number in range(3):
        record(tmp_path / f"{number}.mcap")
    assert len(list(open_files.iterdir())) == before


def test_the_limit_of_files_is_told(tmp_path: Path) -> None:
    sim = Simulation(kbot.load("kbot"))
    soft, hard = resource.getrlimit(resource.RLIMIT_NOFILE)
    feed = Feed(sim.bus, lambda: 0)
    resource.setrlimit(resource.RLIMIT_NOFILE, (3, hard))
    try:
        with pytest.raises(KbotError, match="Too many open files"):
            Recorder(sim, feed, str(tmp_path / "run.mcap"))
    finally:
        resource.setrlimit(resource.RLIMIT_NOFILE, (soft, hard))


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
    simulation._engine.data.qpos[0] = 1e16
    simulation.frames_are_old()
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
    assert simulation.journal is None


def test_a_command_that_cannot_be_recorded_is_refused_where_it_is_given(tmp_path: Path) -> None:
    sim = Simulation(kbot.load("kbot"))
    with Recorder(sim, Feed(sim.bus, lambda: sim.clock.nanoseconds), str(tmp_path / "run.bag")) as recorder:
        sim.run(0.1)
        with pytest.raises(KbotError, match="/cmd_vel: a message cannot be recorded: no geometry_msgs/msg"):
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
    with pytest.raises(KbotError, match="/talk: a message cannot be recorded: no std_msgs/msg/String"):
        recorder.close()
    said = [entry.message().data for entry in Recording(path).entries() if entry.topic == "/talk"]
    assert said == ["before", "after"]
    assert not Recording(path).summary().broken
