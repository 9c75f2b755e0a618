"""Tests `kbot bag` on recordings and on other files."""

import csv
import io
import json
import re
from pathlib import Path

import pytest
from mcap.writer import Writer

from kbot.cli.bag.command import ELSEWHERE
from kbot.cli.main import run
from kbot.messages import Bus
from kbot.messages.sensing import Image
from kbot.record import Recording
from kbot.record.feed import Feed
from kbot.record.writer import open_writer


def test_info(recording: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert run(["bag", "info", recording]) == 0
    text = capsys.readouterr().out
    assert "MCAP, 504 messages over 2.000 s" in text
    assert ["/odom", "100", "nav_msgs/msg/Odometry"] in [line.split() for line in text.splitlines()]
    assert re.search(r"^  time +0\.000 s to 2\.000 s$", text, re.MULTILINE)
    assert re.search(r"^  world +empty$", text, re.MULTILINE)
    assert re.search(r"^  physics +steps of 0\.002 s, .*seed 0$", text, re.MULTILINE)
    assert re.search(r"^  end +after 1000 steps, at 2 s", text, re.MULTILINE)
    assert run(["bag", "info", recording, "--json"]) == 0
    summary = json.loads(capsys.readouterr().out)
    assert summary["topics"]["/odom"] == {"type": "nav_msgs/msg/Odometry", "messages": 100}


def test_info_prints_the_date_and_the_metadata_of_other_programs(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """1.5e9 s after the start of 1970 is 2017-07-14, 02:40 UTC."""
    path = tmp_path / "other.mcap"
    with path.open("wb") as file:
        writer = Writer(file)
        writer.start()
        schema = writer.register_schema("std_msgs/msg/Bool", "ros2msg", b"bool data")
        channel = writer.register_channel("/switch", "cdr", schema)
        writer.add_message(channel, 1_500_000_000 * 10**9, b"\x00\x01\x00\x00\x01", 0)
        writer.add_metadata("rosbag2", {"distro": "jazzy", "note": "two\nlines"})
        writer.finish()
    assert run(["bag", "info", str(path)]) == 0
    lines = [line.split() for line in capsys.readouterr().out.splitlines()]
    assert lines[2][1:4] == ["2017-07-14", "02:40:00", "UTC"]
    assert ["rosbag2.distro", "jazzy"] in lines
    assert ["rosbag2.note", "two", "lines"] in lines


def test_info_reports_an_incomplete_file(
    recording: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    (tmp_path / "cut.mcap").write_bytes(Path(recording).read_bytes()[:-50])
    assert run(["bag", "info", str(tmp_path / "cut.mcap")]) == 1
    assert "504 messages" in (text := capsys.readouterr().out)
    assert "The recording is incomplete: it was not closed" in text


def test_cut_keeps_the_selected_part_and_the_description(recording: str, tmp_path: Path) -> None:
    target = str(tmp_path / "part.mcap")
    assert run(["bag", "cut", recording, target, "--start", "0.5", "--end", "1", "--topic", "/odom"]) == 0
    found = Recording(target).summary()
    assert {name: topic.count for name, topic in found.topics.items()} == {"/odom": 26}
    assert "kbot.end" not in found.notes
    assert run(["bag", "cut", recording, str(tmp_path / "all.mcap"), "--start", "1.9"]) == 0
    assert "/robot_description" in Recording(str(tmp_path / "all.mcap")).summary().topics
    assert run(["bag", "cut", recording, str(tmp_path / "named.mcap"), "--topic", "odom"]) == 0
    assert list(Recording(str(tmp_path / "named.mcap")).summary().topics) == ["/odom"]


def test_a_part_of_a_recording_cannot_be_replayed(
    recording: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    part = str(tmp_path / "part.mcap")
    assert run(["bag", "cut", recording, part, "--start", "1"]) == 0
    assert run(["bag", "replay", part]) == 2
    assert "was cut from a recording: only a whole recording" in capsys.readouterr().err


@pytest.mark.parametrize("name", ["run.bag", "folder"])
def test_convert_there_and_back_is_the_same(recording: str, tmp_path: Path, name: str) -> None:
    there, back = str(tmp_path / name), str(tmp_path / "back.mcap")
    assert run(["bag", "convert", recording, there]) == 0
    assert run(["bag", "convert", there, back]) == 0
    for topic in ("/odom", "/joint_states", "/tf", "/kbot/commands"):
        before = [entry.cdr for entry in Recording(recording).entries() if entry.topic == topic]
        assert [entry.cdr for entry in Recording(back).entries() if entry.topic == topic] == before


def test_export_has_the_numbers(recording: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert run(["bag", "export", recording, "--topic", "/odom"]) == 0
    rows = list(csv.DictReader(io.StringIO(capsys.readouterr().out)))
    last = [e.message() for e in Recording(recording).entries() if e.topic == "/odom"][-1]
    assert len(rows) == 100
    assert [row["time"] for row in rows][::12] == [
        *("0.02", "0.26", "0.5", "0.74", "0.98"),
        *("1.22", "1.46", "1.7", "1.94"),
    ]
    assert float(rows[-1]["time"]) == 2.0
    assert float(rows[-1]["pose.pose.position.x"]) == last.pose.pose.position.x
    assert rows[-1]["child_frame_id"] == last.child_frame_id
    assert float(rows[-1]["pose.covariance.35"]) == 0.001  # of libgazebo_ros_diff_drive.so


def test_export_names_joints(recording: str, tmp_path: Path) -> None:
    target = tmp_path / "joints.csv"
    assert run(["bag", "export", recording, "--topic", "/joint_states", "-o", str(target)]) == 0
    header = target.read_text().splitlines()[0].split(",")
    assert "position.left_wheel_joint" in header
    assert "velocity.right_wheel_joint" in header


def test_export_has_bytes_in_one_column(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """A picture of 2 x 1 pixels has six numbers of one byte each."""
    path = str(tmp_path / "pictures.mcap")
    bus, writer = Bus(), open_writer(path)
    publisher = bus.advertise("/image", Image)
    Feed(bus, lambda: 5).open("/image", writer.write)
    publisher.publish(Image(height=1, width=2, encoding="rgb8", step=6, data=bytes([255, 0, 0, 0, 0, 255])))
    writer.close()
    assert run(["bag", "export", path, "--topic", "image"]) == 0
    (row,) = csv.DictReader(io.StringIO(capsys.readouterr().out))
    assert row["data"] == "/wAAAAD/"
    assert (row["width"], row["encoding"]) == ("2", "rgb8")


@pytest.mark.parametrize("word", ELSEWHERE)
def test_a_missing_command_of_rosbag_names_the_replacement(
    word: str, capsys: pytest.CaptureFixture[str]
) -> None:
    assert run(["bag", word, "run.bag"]) == 2
    assert f"no such command: {word}; {ELSEWHERE[word]}" in capsys.readouterr().err


def test_replay(recording: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert run(["bag", "replay", recording]) == 0
    same, left_out = capsys.readouterr().out.splitlines()
    assert same == "400 messages are the same, bit for bit; the engine ended in the same state"
    # of all 504 messages, the command and the description are inputs of the replay
    assert left_out.startswith("102 messages were not compared (/kbot/poses 101, /kbot/world 1): ")


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (["info", "nothing.mcap"], "nothing.mcap does not exist"),
        (["info", "text.mcap"], "text.mcap is not an MCAP file"),
        (["info", "text.bag"], "cannot be read as a ROS 1 bag"),
        (["info", "text.txt"], "is not a recording"),
        (
            ["info", "."],
            ". is not a rosbag2 folder: it has no metadata.yaml; you can read a file in it: text.mcap",
        ),
        (["replay", "nothing.mcap"], "nothing.mcap does not exist"),
        (
            ["cut", "RUN", "out.mcap", "--start", "3", "--end", "1"],
            "the end of the cut, 1 s, is before its start, 3 s",
        ),
        (["cut", "RUN", "out.mcap", "--start", "3"], "ends at 2 s, before the start of the cut at 3 s"),
        (
            ["cut", "tiny.mcap", "out.mcap", "--end", "0"],
            "begins at 7e-09 s, after the end of the cut at 0 s",
        ),
        (["play", "RUN", "--remap", "/odom"], "--remap takes OLD:=NEW, not '/odom'"),
        (["play", "RUN", "--remap", "/odmo:=/a"], "has no topic /odmo: did you mean"),
        (["play", "RUN", "--remap", "/odom:=/tf"], "/tf carries "),
        (["play", "RUN", "--exclude-topics"], "--exclude-topics needs at least one value"),
        (["cut", "RUN", "out.mcap", "--start", "1e308"], "1e+308 is not in the range"),
        (["cut", "RUN", "out.mcap", "--end", "nan"], "nan is not in the range"),
        (["play", "RUN", "--start", "inf"], "inf is not in the range"),
        (["play", "RUN", "--rate", "nan"], "nan is not in the range"),
        (["play", "RUN", "--topics"], "--topics needs at least one value"),
        (["play", "RUN", "--topics", "/odmo", "--loop"], "has no topic /odmo: did you mean"),
        (["play", "RUN", "-s", "3"], "is 2 s long: playback cannot start at 3 s"),
        (["play", "RUN", "-u", "0", "-l"], "--loop has nothing to repeat"),
        (["play", "RUN", "-u", "1e-10", "-l"], "--loop has nothing to repeat"),
        (["play", "RUN", "-s", "2", "-l"], "--loop has nothing to repeat"),
        (["play", "tiny.mcap", "-l"], "the selected part of tiny.mcap lasts 0 s"),
        (["cut", "RUN", "out.mcap", "--topic", "/odmo"], "has no topic /odmo: did you mean"),
        (["convert", "RUN", "out.xyz"], "unknown recording format '.xyz'"),
        (["convert", "RUN", "text.bag"], "text.bag already exists"),
        (["export", "RUN", "--topic", "/nope"], "has no topic /nope"),
    ],
)
def test_impossible_commands_are_one_clear_error(
    recording: str,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
    words: list[str],
    message: str,
) -> None:
    monkeypatch.chdir(tmp_path)
    for name in ("text.mcap", "text.bag", "text.txt"):
        Path(name).write_text("this is text")
    with Path("tiny.mcap").open("wb") as file:
        writer = Writer(file)
        writer.start()
        schema = writer.register_schema("std_msgs/msg/String", "ros2msg", b"string data")
        channel = writer.register_channel("/said", "cdr", schema)
        writer.add_message(channel, log_time=7, publish_time=7, data=b"\0\1\0\0\1\0\0\0\0")
        writer.finish()
    assert run(["bag", *(recording if word == "RUN" else word for word in words)]) == 2
    error = capsys.readouterr().err
    assert message in error
    assert "Traceback" not in error
    assert not Path("out.mcap").exists()


def test_a_recording_is_never_overwritten(
    recording: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    whole = Path(recording).read_bytes()
    for name in ("run.mcap", "other.mcap", "renamed.csv"):
        Path(name).write_bytes(whole)
    Path("link.csv").symlink_to("run.mcap")
    assert run(["bag", "convert", "run.mcap", "folder"]) == 0
    before = {path: path.read_bytes() for path in tmp_path.rglob("*") if path.is_file()}
    export = ("export", "run.mcap", "--topic", "/odom", "-o")
    of_folder = ("export", "folder", "--topic", "/odom", "-o")
    for words, message in (
        ((*export, "run.mcap"), "run.mcap is the recording itself"),
        ((*export, "./link.csv"), "link.csv is the recording itself"),
        ((*export, "other.mcap"), "other.mcap is a recording"),
        ((*export, "renamed.csv"), "renamed.csv is a recording"),
        ((*export, "folder/metadata.yaml"), "folder/metadata.yaml is a recording"),
        ((*of_folder, "folder/odom.csv"), "folder/odom.csv is in the folder of the recording"),
        ((*of_folder, "folder/folder.db3"), "is in the folder of the recording"),
        (("cut", "run.mcap", "run.mcap"), "run.mcap is the recording itself"),
        (("convert", "folder", "folder/run.bag"), "folder/run.bag is in the folder of the recording"),
        (("convert", "folder", "folder/again"), "folder/again is in the folder of the recording"),
    ):
        assert run(["bag", *words]) == 2, words
        assert message in capsys.readouterr().err
    assert {path: path.read_bytes() for path in tmp_path.rglob("*") if path.is_file()} == before
    assert run(["bag", *export, "odom.csv"]) == 0
    assert run(["bag", *export, "odom.csv"]) == 0  # a table may be overwritten
