"""The settings of rosbag play and ros2 bag play."""

from pathlib import Path

import pytest

from kbot.ros.launch import read_launch, read_launch_2
from kbot.ros.launch.staging import Stage, stage
from kbot.ros.nodes.playing import Playing
from kbot.xacro import Packages


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    for name in ("a.bag", "b.bag", "c.mcap"):
        (tmp_path / name).touch()
    return tmp_path


def staged(folder: Path, args: str, more: str = "", inner: str = "", beside: str = "") -> Stage:
    file = folder / "a.launch"
    file.write_text(
        f'<launch><node pkg="rosbag" type="play" name="p" args="{args}" {more}>{inner}</node>'
        f"{beside}</launch>"
    )
    return stage(read_launch(str(file), packages=Packages(around=str(file))).require())


def staged_2(folder: Path, args: str) -> Stage:
    file = folder / "a.launch.xml"
    file.write_text(f'<launch><executable cmd="ros2 bag play {args}"/></launch>')
    return stage(read_launch_2(str(file), packages=Packages(around=str(file))).require())


def only(found: Stage) -> Playing:
    (playing,) = found.stand_ins.playings
    return playing


def test_ros1_options_are_read_in_long_and_short_form(folder: Path) -> None:
    bags = f"{folder}/a.bag {folder}/b.bag"
    long = only(staged(folder, f"--rate=2 --start=1.5 --duration=3 --delay=0.5 --loop {bags}"))
    short = only(staged(folder, f"-r 2 -s 1.5 -u 3 -d 0.5 -l {bags}"))
    for playing in (long, short):
        assert playing.paths == (f"{folder}/a.bag", f"{folder}/b.bag")
        assert (playing.rate, playing.start, playing.seconds, playing.delay) == (2.0, 1.5, 3.0, 0.5)
        assert (playing.loop, playing.required) == (True, False)


def test_topics_can_be_before_or_after_the_bag(folder: Path) -> None:
    after = only(staged(folder, f"{folder}/a.bag --topics /odom scan"))
    before = only(staged(folder, f"--topics /odom scan --bags={folder}/a.bag"))
    last = only(staged(folder, f"--topics /odom scan {folder}/a.bag"))
    for playing in (after, before, last):
        assert (playing.topics, playing.paths) == (("/odom", "/scan"), (f"{folder}/a.bag",))


def test_topics_are_renamed_by_arguments_remaps_and_prefix(folder: Path) -> None:
    inner = '<remap from="/scan" to="/bag/scan"/>'
    playing = only(staged(folder, f"{folder}/a.bag -p old odom:=/truth", inner=inner))
    topics = [playing.published_name(topic) for topic in ("/odom", "/scan", "/tf")]
    assert topics == ["/truth", "/bag/scan", "/old/tf"]


def test_ros2_options_are_read(folder: Path) -> None:
    words = f"-s mcap {folder}/c.mcap --clock 100 -r 0.5 --start-offset 2 --remap /a:=/b /c:=/d -l"
    playing = only(staged_2(folder, words))
    assert (playing.paths, playing.rate, playing.start) == ((f"{folder}/c.mcap",), 0.5, 2.0)
    assert (dict(playing.remaps), playing.loop) == ({"/a": "/b", "/c": "/d"}, True)


def test_required_player_ends_the_launch(folder: Path) -> None:
    required = 'required="true"'
    assert only(staged(folder, f"{folder}/a.bag", required)).required
    assert not only(staged(folder, f"-k {folder}/a.bag", required)).required


@pytest.mark.parametrize(
    ("args", "code", "is_error", "word"),
    [
        ("missing.bag", "L059", False, "missing.bag"),
        ("", "L059", False, ""),
        ("-r fast {}/a.bag", "L062", True, "fast"),
        ("--pause {}/a.bag", "L063", False, "--pause"),
        ("-r 1e308 {}/a.bag", "L062", True, "1e308"),
        ("--rate=0 {}/a.bag", "L062", True, "--rate=0"),
        ("-s 1e308 {}/a.bag", "L062", True, "1e308"),
        ("-u 1e308 {}/a.bag", "L062", True, "1e308"),
        ("-d 1e308 {}/a.bag", "L062", True, "1e308"),
        ("-s -1 {}/a.bag", "L062", True, "-1"),
        ("-u -1 {}/a.bag", "L062", True, "-1"),
        ("-l -u 0 {}/a.bag", "L062", True, "0"),
    ],
)
def test_invalid_value_is_reported_at_its_word(
    folder: Path, args: str, code: str, is_error: bool, word: str
) -> None:
    (note,) = staged(folder, args.format(folder)).notes
    assert note.origin is not None
    assert (note.code, note.is_error, note.origin.span.text) == (code, is_error, word)


@pytest.mark.parametrize(("args", "paused"), [("--pause {}/a.bag", True), ("{}/a.bag", False)])
def test_player_with_a_simulation_can_start_paused(folder: Path, args: str, paused: bool) -> None:
    """P in the page continues both."""
    robot = '<node pkg="gazebo_ros" type="spawn_model" name="s" args="-urdf -param r -model m"/>'
    found = staged(folder, args.format(folder), beside=robot)
    assert only(found).paused is found.gazebo.paused is paused
    assert not [note for note in found.notes if note.code == "L063"]


def test_each_invalid_number_is_reported_at_its_option(folder: Path) -> None:
    notes = staged(folder, f"-s -1 -u -1 --delay=-1 {folder}/a.bag").notes
    assert sorted((note.origin.span.column, note.message) for note in notes if note.origin) == [
        (58, "-s must be 0 to 1e+09 seconds, not -1"),
        (64, "-u must be 0 to 1e+09 seconds, not -1"),
        (67, "--delay must be 0 to 1e+09 seconds, not -1"),
    ]


def test_negative_duration_means_all_in_ros2_and_other_numbers_are_limited(folder: Path) -> None:
    whole = staged_2(folder, f"{folder}/c.mcap --playback-duration -1")
    assert (only(whole).seconds, whole.notes) == (None, ())
    found = staged_2(folder, f"{folder}/c.mcap -r 1e308 --start-offset 1e308 --delay 1e308")
    assert [note.code for note in found.notes] == ["L062"] * 3
    assert (only(found).rate, only(found).start, only(found).delay) == (1.0, 0.0, 0.0)
