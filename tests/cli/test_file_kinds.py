"""A file is what its content says, for every verb that takes a file."""

import json
import re
from pathlib import Path

import pytest
import yaml

from kbot.checks.folder_files import entry_points
from kbot.cli.main import run
from kbot.templates.package import find_robot
from kbot.text import KbotError
from kbot.trials.robot_folder import robot_of_folder
from kbot.world import load_world

ROOT = Path(__file__).parents[2]
ROBOT = '<robot name="r"><link name="base"/></robot>'
LAUNCH = """<launch>
  <node pkg="robot_state_publisher" exec="robot_state_publisher">
    <param name="robot_description" value="$(command 'cat $(dirname)/robot.xml')" type="str"/>
  </node>
</launch>
"""
PYTHON = """from launch import LaunchDescription

def generate_launch_description():
    return LaunchDescription([])
"""
YAML = "launch:\n- arg: {name: a, default: b}\n"


@pytest.fixture
def package(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    files = {
        "show_launch.xml": LAUNCH,
        "demo_launch.py": PYTHON,
        "demo_launch.yaml": YAML,
        "robot.xml": ROBOT,
        "params.yaml": "node:\n  ros__parameters: {launch: 1}\n",
        "tree.xml": "<root main_tree_to_execute='a'/>",
        "part.urdf": "<robot/>",
        "odd.urdf": LAUNCH,
        "odd.launch": ROBOT,
    }
    for name, text in files.items():
        (tmp_path / name).write_text(text)
    monkeypatch.chdir(tmp_path)
    return tmp_path


@pytest.mark.parametrize("name", ["show_launch.xml", "demo_launch.yaml", "robot.xml", "odd.urdf"])
def test_check_finds_nothing_in_a_right_file_of_any_name(
    package: Path, capsys: pytest.CaptureFixture[str], name: str
) -> None:
    assert run(["check", name, "--ignore", "U,S,I,G"]) == 0
    assert "error" not in "".join(capsys.readouterr())


def test_check_of_a_python_launch_file_says_that_it_does_not_run_it(
    package: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    run(["check", "demo_launch.py", "--json"])
    report = json.loads(capsys.readouterr().out)
    assert [finding["code"] for finding in report["findings"]] == ["L080"]


def test_folder_search_finds_launch_files_and_robots_by_their_content(package: Path) -> None:
    found = [Path(file).name for file in entry_points(str(package))]
    # a launch file in Python is a program, which a search does not name
    assert found == ["demo_launch.yaml", "odd.launch", "odd.urdf", "robot.xml", "show_launch.xml"]


def test_robot_of_a_folder_is_found_by_its_content(package: Path) -> None:
    (package / "odd.launch").unlink()
    assert robot_of_folder(str(package)) == str(package / "robot.xml")
    (package / "robot.xml").unlink()
    with pytest.raises(KbotError, match="contains no robot"):
        robot_of_folder(str(package))


@pytest.mark.parametrize("name", ["show_launch.xml", "demo_launch.py", "demo_launch.yaml", "odd.urdf"])
@pytest.mark.parametrize(
    "verb",
    [
        ["sim", "--headless", "--duration", "1"],
        ["view", "--no-browser"],
        ["expand"],
        ["info"],
        ["export", "--to", "tree"],
        ["where", "base"],
    ],
    ids=lambda words: words[0],
)
def test_verb_for_robots_names_the_verb_for_launch_files(
    package: Path, capsys: pytest.CaptureFixture[str], verb: list[str], name: str
) -> None:
    assert run([verb[0], name, *verb[1:]]) == 2
    printed = "".join(capsys.readouterr())
    assert "is not a robot: it is a launch file" in printed
    assert "kbot launch FILE" in printed
    assert printed.count("error: ") == 1


def test_launch_lists_the_launch_files_of_a_folder(package: Path, capsys: pytest.CaptureFixture[str]) -> None:
    run(["launch", "."])
    assert "demo_launch.py, demo_launch.yaml, show_launch.xml" in capsys.readouterr().err


def test_world_in_a_file_of_any_name_is_loaded(package: Path) -> None:
    (package / "room.xml").write_text("<sdf version='1.9'><world name='room'/></sdf>")
    assert load_world("room.xml").name == "room"
    with pytest.raises(KbotError, match=r"robot\.xml is not a world"):
        load_world("robot.xml")


def test_new_finds_the_robot_of_a_package_by_its_content(package: Path) -> None:
    (package / "urdf").mkdir()
    (package / "urdf" / "a.urdf").write_text(LAUNCH)
    (package / "urdf" / "b.xml").write_text(ROBOT)
    assert find_robot(package, "mine") == Path("urdf/b.xml")


def test_pre_commit_runs_for_each_ending_of_a_checked_file() -> None:
    (hook, *_) = yaml.safe_load((ROOT / ".pre-commit-hooks.yaml").read_text())
    for name in (
        "show_launch.xml",
        "demo_launch.yaml",
        "robot.xml",
        "package.xml",
        "r.urdf",
        "r.xacro",
        "a.launch",
    ):
        assert re.search(hook["files"], f"folder/{name}")
