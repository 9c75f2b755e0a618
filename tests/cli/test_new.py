"""Tests the command `kbot new`: the new robot has no findings, and drives."""

import math
import os
import re
import shutil
import subprocess
import sys
import xml.etree.ElementTree as ElementTree
from pathlib import Path

import pytest
import yaml

import kbot
from kbot.cli.main import run

SIZES = {
    "plain": (),
    "big": ("--length", "1.2", "--width", "0.8", "--height", "0.3", "--wheel-radius", "0.2"),
    "small": ("--length", "0.08", "--width", "0.06", "--height", "0.02", "--wheel-radius", "0.015"),
    "tiny": (
        *("--length", "0.005", "--width", "0.004", "--height", "0.002"),
        *("--wheel-radius", "0.002", "--wheel-width", "0.002"),
    ),
    "high": ("--wheel-radius", "0.22"),
    "wide": ("--separation", "0.5", "--wheel-width", "0.05"),
}


@pytest.fixture
def here(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.chdir(tmp_path)
    return tmp_path


@pytest.mark.parametrize("flags", SIZES.values(), ids=SIZES)
def test_a_new_package_has_no_findings(
    here: Path, capsys: pytest.CaptureFixture[str], flags: tuple[str, ...]
) -> None:
    assert run(["new", "my_robot", *flags]) == 0
    capsys.readouterr()
    assert run(["check", "my_robot"]) == 0
    assert capsys.readouterr() == ("", "")


def test_a_new_robot_has_the_requested_sizes(here: Path) -> None:
    run(["new", "my_robot", "--length", "0.4", "--wheel-radius", "0.08", "--separation", "0.3"])
    robot = kbot.load("my_robot/urdf/my_robot.xacro")
    left = robot.pose("left_wheel", in_frame="base_footprint").translation
    right = robot.pose("right_wheel", in_frame="base_footprint").translation
    assert left[1] - right[1] == pytest.approx(0.3)
    assert left[2] == pytest.approx(0.08)


@pytest.mark.parametrize("flags", SIZES.values(), ids=SIZES)
@pytest.mark.parametrize("file", ["view.rviz", "view_ros2.rviz"])
def test_rviz_shows_the_whole_robot(here: Path, flags: tuple[str, ...], file: str) -> None:
    """With a 45 degree field of view, a ball of radius r is fully visible from r / sin(22.5 degrees) on."""
    run(["new", "my_robot", *flags])
    displays = yaml.safe_load(Path("my_robot/config", file).read_text())
    distance = displays["Visualization Manager"]["Views"]["Current"]["Distance"]
    robot = kbot.load("my_robot/urdf/my_robot.xacro")
    body = robot.links["base_link"].visuals[0].geometry
    behind = robot.pose("base_link", in_frame="base_footprint").translation[0] - body.size[0] / 2
    beside = robot.pose("left_wheel", in_frame="base_footprint").translation[1]
    least = math.hypot(behind, beside) / math.sin(math.radians(22.5))
    assert least < distance < 2 * least


@pytest.fixture
def repository(here: Path) -> Path:
    """A git repository with a new package."""
    if not shutil.which("git"):
        pytest.skip("git is not installed")
    run(["new", "my_robot"])
    for words in (["init", "-q"], ["add", "--all"], [*WHO, "commit", "-q", "-m", "all"]):
        subprocess.run(["git", *words], cwd=here / "my_robot", check=True)
    return here / "my_robot"


WHO = ("-c", "user.name=kbot", "-c", "user.email=kbot@localhost")


def run_pytest(folder: Path) -> subprocess.CompletedProcess[str]:
    """Run pytest in a folder without any plugin but KBot's."""
    words = [sys.executable, "-m", "pytest", "-p", "kbot.pytest_plugin"]
    environment = os.environ | {"PYTEST_DISABLE_PLUGIN_AUTOLOAD": "1", "PYTEST_ADDOPTS": ""}
    return subprocess.run(words, cwd=folder, env=environment, capture_output=True, text=True, check=False)


@pytest.mark.parametrize(
    ("file", "before", "after"),
    [
        ("drive.xacro", "<wheelSeparation>${separation}", "<wheelSeparation>${1.1*separation}"),
        (
            "macros.xacro",
            '<cylinder radius="${wheel_radius}"',
            "<cylinder radius=\"${wheel_radius*(1.1 if name == 'left_wheel' else 1)}\"",
        ),
    ],
    ids=["separation", "one radius"],
)
def test_the_tests_of_a_new_package_refuse_a_bad_change_with_its_line(
    repository: Path, file: str, before: str, after: str
) -> None:
    changed = repository / "urdf" / file
    text = changed.read_text("utf-8")
    changed.write_text(text.replace(before, after), "utf-8")
    done = run_pytest(repository)
    assert done.returncode == 1, done.stdout + done.stderr
    lines = [str(number) for number, line in enumerate(text.splitlines(), 1) if before in line]
    assert re.search(rf"{file}:({'|'.join(lines)}):\d+", done.stdout.partition("KBot: findings")[2])
    subprocess.run(["git", "checkout", "-q", "."], cwd=repository, check=True)
    assert run_pytest(repository).returncode == 0


def test_the_tests_of_a_new_package_accept_a_good_change(repository: Path) -> None:
    robot = repository / "urdf" / "my_robot.xacro"
    text = robot.read_text("utf-8").replace("${500*length", "${700*length")
    robot.write_text(text.replace('name="wheel_radius" default="0.05"', 'name="wheel_radius" default="0.06"'))
    done = run_pytest(repository)
    assert done.returncode == 0, done.stdout + done.stderr
    assert "2 passed" in done.stdout


@pytest.mark.parametrize("flags", SIZES.values(), ids=SIZES)
def test_the_tests_of_a_new_package_pass_for_robots_of_all_sizes(here: Path, flags: tuple[str, ...]) -> None:
    run(["new", "my_robot", *flags])
    done = run_pytest(here / "my_robot" / "test")
    assert done.returncode == 0, done.stdout + done.stderr


@pytest.mark.parametrize("flags", SIZES.values(), ids=SIZES)
def test_a_new_robot_drives_straight_and_turns_as_commanded(here: Path, flags: tuple[str, ...]) -> None:
    run(["new", "my_robot", *flags])
    simulation = kbot.Simulation("my_robot/urdf/my_robot.xacro")
    simulation.cmd_vel(0.1, 0.0)
    simulation.run(2.0)
    start = simulation.ground_truth.pose
    simulation.run(10.0)
    pose = simulation.ground_truth.pose
    # 0.1 m/s for 10 s is 1 m
    assert pose.x - start.x == pytest.approx(1.0, abs=0.01)
    assert pose.y == pytest.approx(0.0, abs=0.002)
    assert pose.yaw == pytest.approx(0.0, abs=math.radians(0.2))
    simulation.cmd_vel(0.0, 0.4)
    simulation.run(3.0)
    start = simulation.ground_truth.pose
    simulation.run(5.0)
    assert simulation.ground_truth.unwrapped_yaw - start.yaw == pytest.approx(2.0, rel=0.02)


def test_the_manifest_has_the_name_and_both_build_types(here: Path) -> None:
    run(["new", "my_robot"])
    root = ElementTree.parse("my_robot/package.xml").getroot()
    assert (root.tag, root.get("format"), root.findtext("name")) == ("package", "3", "my_robot")
    types = {e.text: e.get("condition") for e in root.iter("build_type")}
    assert types == {"catkin": "$ROS_VERSION != 2", "ament_cmake": "$ROS_VERSION == 2"}


@pytest.mark.parametrize(
    "file", ["display.launch", "simulate.launch", "display_ros2.launch.xml", "simulate_ros2.launch.xml"]
)
def test_the_launch_files_of_a_new_package_run(
    here: Path, capsys: pytest.CaptureFixture[str], file: str
) -> None:
    run(["new", "my_robot"])
    capsys.readouterr()
    assert run(["launch", "my_robot", file, "--dry-run"]) == 0
    out, err = capsys.readouterr()
    assert err == ""
    assert "robot: " in out
    assert "not run" not in out


def test_an_existing_folder_gets_what_is_missing(here: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """Every file that exists keeps its bytes."""
    mine = {"notes.txt": "mine", "CMakeLists.txt": "# mine", "launch/display.launch": "<launch/>"}
    for name, text in mine.items():
        (here / "my_robot" / name).parent.mkdir(parents=True, exist_ok=True)
        (here / "my_robot" / name).write_text(text)
    assert run(["new", "my_robot"]) == 0
    out = capsys.readouterr().out
    added, kept = out.split("Kept:\n")
    assert "my_robot/package.xml" in added
    assert "my_robot/urdf/my_robot.xacro" in added
    assert "my_robot/launch/display.launch\n" not in added
    assert {"  my_robot/CMakeLists.txt", "  my_robot/launch/display.launch"} <= {*kept.splitlines()}
    assert {name: (here / "my_robot" / name).read_text() for name in mine} == mine
    assert run(["launch", "my_robot", "simulate.launch", "--dry-run"]) == 0
    capsys.readouterr()
    assert run(["new", "my_robot"]) == 0
    assert "Added" not in capsys.readouterr().out


ROBOT = """<?xml version="1.0"?>
<robot name="kbot" xmlns:xacro="http://www.ros.org/wiki/xacro">
  <xacro:include filename="$(find my_robot)/urdf/wheels.xacro"/>
  <link name="chassis"><visual><geometry><box size="1 1 1"/></geometry></visual></link>
</robot>
"""


@pytest.mark.parametrize(
    "file", ["display.launch", "simulate.launch", "display_ros2.launch.xml", "simulate_ros2.launch.xml"]
)
def test_the_launch_files_of_a_package_with_a_robot_show_this_robot(
    here: Path, capsys: pytest.CaptureFixture[str], file: str
) -> None:
    folder = here / "my_robot" / "urdf"
    folder.mkdir(parents=True)
    (folder / "kbot.xacro").write_text(ROBOT)
    (folder / "wheels.xacro").write_text('<robot name="wheels"/>')
    assert run(["new", "my_robot", "--length", "0.4"]) == 0
    out, err = capsys.readouterr()
    assert "Drive it:  kbot sim my_robot/urdf/kbot.xacro" in out
    assert err == "note: --length has no effect, because my_robot/urdf/kbot.xacro already exists\n"
    assert sorted(path.name for path in folder.iterdir()) == ["kbot.xacro", "wheels.xacro"]
    assert (folder / "kbot.xacro").read_text() == ROBOT
    assert not (here / "my_robot" / "README.md").exists()
    assert not (here / "my_robot" / "test").exists()
    assert "Fixed Frame: chassis\n" in (here / "my_robot" / "config" / "view.rviz").read_text()
    assert run(["launch", "my_robot", file, "--dry-run"]) in (0, 1)  # the robot has findings
    assert "urdf/kbot.xacro" in capsys.readouterr().out


def test_a_robot_with_errors_gets_launch_files_too(here: Path) -> None:
    folder = here / "my_robot" / "urdf"
    folder.mkdir(parents=True)
    (folder / "my_robot.urdf.xacro").write_text('<robot name="r"><link name="base"/><joint')
    assert run(["new", "my_robot"]) == 0
    assert "/urdf/my_robot.urdf.xacro" in (here / "my_robot/launch/display.launch").read_text()
    assert "Fixed Frame: base\n" in (here / "my_robot/config/view.rviz").read_text()


def test_the_package_keeps_the_name_of_its_manifest(here: Path) -> None:
    (here / "robots").mkdir()
    manifest = "<package><name>other_name</name></package>"
    (here / "robots" / "package.xml").write_text(manifest)
    assert run(["new", "robots"]) == 0
    assert (here / "robots" / "package.xml").read_text() == manifest
    assert "$(find other_name)/urdf/other_name.xacro" in (here / "robots/launch/display.launch").read_text()
    assert (here / "robots" / "urdf" / "other_name.xacro").is_file()


@pytest.mark.parametrize("name", ["launch", "urdf"])
def test_a_file_in_place_of_a_folder_leaves_the_folder_as_it_is(
    here: Path, capsys: pytest.CaptureFixture[str], name: str
) -> None:
    (here / "my_robot").mkdir()
    (here / "my_robot" / name).write_text("mine")
    assert run(["new", "my_robot"]) == 2
    assert f"{name}: " in capsys.readouterr().err
    assert [path.name for path in (here / "my_robot").iterdir()] == [name]
    assert (here / "my_robot" / name).read_text() == "mine"


def test_a_file_of_the_name_is_not_changed(here: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (here / "my_robot").write_text("mine")
    assert run(["new", "my_robot"]) == 2
    assert "my_robot is not a folder" in capsys.readouterr().err
    assert (here / "my_robot").read_text() == "mine"


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (
            ("My-Robot",),
            "'My-Robot' is not a valid package name. Use two or more lower-case letters, digits and",
        ),
        (("My-Robot",), ", for example my_robot\n"),
        (("1robot",), ", for example robot\n"),
        (("r",), "is not a valid package name"),
        (("con",), "it is a device on Windows. Use con_robot"),
        (
            ("catkin",),
            "'catkin' is not a valid package name: the new package depends on a package of this name. "
            "Use catkin_robot",
        ),
        (("ros_gz_bridge",), "'ros_gz_bridge' is not a valid package name: the new package depends on"),
        (("lpt1",), "it is a device on Windows"),
        (("a__b",), "is not a valid package name"),
        (("../robot",), "is not a valid package name"),
        (("robot", "--length", "0"), "--length must be between 0.002 and 100 m, not 0"),
        (("robot", "--wheel-radius", "nan"), "--wheel-radius must be between 0.002 and 100 m, not nan"),
        (
            ("robot", "--separation", "0.1"),
            "the wheels would be inside the body: --separation must be at least 0.22 m",
        ),
        (("robot", "--wheel-radius", "2"), "--wheel-radius must be at most 0.22 m, not 2: the caster"),
        (("robot", "--wheel-radius", "0.03", "--length", "0.02"), "--wheel-radius must be at most 0.02 m"),
        (("robot", "--in", "nowhere"), "nowhere"),
    ],
)
def test_invalid_options_are_one_clear_error_and_create_nothing(
    here: Path, capsys: pytest.CaptureFixture[str], words: tuple[str, ...], message: str
) -> None:
    assert run(["new", *words]) == 2
    assert message in capsys.readouterr().err
    assert list(here.iterdir()) == []
