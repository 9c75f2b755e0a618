"""How KBot runs a plan: robots, worlds, poses and windows."""

from pathlib import Path

import pytest

from kbot.ros.launch import read_launch
from kbot.ros.launch.node_settings.spawning import SpawnRequest
from kbot.ros.launch.staging import Stage, stage
from kbot.xacro import Packages

GAZEBO = """<launch>
  <param name="robot_description" command="xacro $(dirname)/r.xacro"/>
  <param name="other" command="xacro $(dirname)/s.xacro side:=left"/>
  <include file="$(find gazebo_ros)/launch/empty_world.launch">{passed}</include>
  <node pkg="gazebo_ros" type="spawn_model" name="spawn" args="-urdf -param {param} -model m{more}"/>
</launch>
"""


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    for name in ("r", "s"):
        (tmp_path / f"{name}.xacro").write_text(f'<robot name="{name}"><link name="a"/></robot>')
    return tmp_path


def staged(folder: Path, text: str) -> Stage:
    file = folder / "a.launch"
    file.write_text(text)
    return stage(read_launch(str(file), packages=Packages(around=str(file))).require())


def test_spawned_robot_is_simulated_in_the_named_world(folder: Path) -> None:
    world = '<arg name="world_name" value="worlds/boxes.world"/>'
    found = staged(folder, GAZEBO.format(passed=world, param="robot_description", more=""))
    assert (found.robots[0].path, found.robots[0].arguments) == (str(folder / "r.xacro"), {})
    assert (found.is_simulated, found.gazebo.world, found.gazebo.paused, found.notes) == (
        True,
        "worlds/boxes.world",
        False,
        (),
    )


def test_robot_is_the_spawned_parameter(folder: Path) -> None:
    found = staged(folder, GAZEBO.format(passed="", param="other", more=""))
    assert (found.robots[0].path, found.robots[0].arguments) == (str(folder / "s.xacro"), {"side": "left"})
    assert found.gazebo.world == "worlds/empty.world"


def test_robot_is_the_spawned_file(folder: Path) -> None:
    found = staged(folder, GAZEBO.format(passed="", param="other", more=f" -file {folder}/r.xacro"))
    assert found.robots[0].path == str(folder / "r.xacro")


def test_start_pose_is_that_of_the_spawner(folder: Path) -> None:
    more = " -x 1 -y -2.5 -z 0.3 -R 0.1 -P 0.2 -Y 0.5 -J arm 0.7 -J lift -1"
    found = staged(folder, GAZEBO.format(passed="", param="other", more=more))
    assert found.robots[0].spawn == SpawnRequest(
        1.0, -2.5, 0.3, 0.1, 0.2, 0.5, {"arm": 0.7, "lift": -1.0}, model="m"
    )
    assert found.notes == ()


def test_start_that_is_not_a_number_is_an_error_at_its_word(folder: Path) -> None:
    found = staged(folder, GAZEBO.format(passed="", param="other", more=" -x two"))
    (note,) = found.notes
    assert note.origin is not None
    assert (note.code, note.is_error, note.origin.span.text) == ("L062", True, "two")


@pytest.mark.parametrize("option", ["-package_to_model", "-reference_frame table::top"])
def test_spawner_option_without_effect_is_reported(folder: Path, option: str) -> None:
    found = staged(folder, GAZEBO.format(passed="", param="other", more=f" {option}"))
    (note,) = found.notes
    assert note.origin is not None
    assert (note.code, note.is_error, note.origin.span.text) == ("L063", False, option.split()[0])


@pytest.mark.parametrize(
    ("passed", "unpause", "paused", "window"),
    [
        ("", "", False, True),
        ('<arg name="paused" value="true"/>', "", True, True),
        ('<arg name="paused" value="true"/>', " -unpause", False, True),
        ('<arg name="gui" value="false"/>', "", False, False),
        ('<arg name="headless" value="true"/>', "", False, False),
    ],
)
def test_gazebo_arguments_set_pause_and_window(
    folder: Path, passed: str, unpause: str, paused: bool, window: bool
) -> None:
    found = staged(folder, GAZEBO.format(passed=passed, param="other", more=unpause))
    assert (found.gazebo.paused, found.has_window) == (paused, window)


def test_rviz_opens_a_window_without_gazebo_gui(folder: Path) -> None:
    rviz = '<node pkg="rviz" type="rviz" name="rviz"/></launch>'
    text = GAZEBO.format(passed='<arg name="gui" value="false"/>', param="other", more="")
    assert staged(folder, text.replace("</launch>", rviz)).has_window


def test_robot_without_a_spawner_is_shown_and_not_simulated(folder: Path) -> None:
    text = '<launch><param name="robot_description" command="xacro $(dirname)/r.xacro"/></launch>'
    found = staged(folder, text)
    assert (found.robots[0].path, found.is_simulated, found.gazebo.world) == (
        str(folder / "r.xacro"),
        False,
        "empty",
    )


def test_launch_file_of_a_world_names_the_world(folder: Path) -> None:
    text = '<launch><include file="$(find gazebo_ros)/launch/mud_world.launch"/></launch>'
    assert staged(folder, text).gazebo.world == "mud.world"


@pytest.mark.parametrize("how", ['textfile="$(dirname)/r.xacro"', 'command="cat $(dirname)/r.xacro"'])
def test_robot_can_be_a_file_that_is_not_expanded(folder: Path, how: str) -> None:
    launch = f'<launch><param name="robot_description" {how}/></launch>'
    assert staged(folder, launch).robots[0].path == str(folder / "r.xacro")
    (folder / "r.xacro").write_text('<robot xmlns:xacro="http://x" name="r"><xacro:a/></robot>')
    assert staged(folder, launch).robots == ()


def test_tests_are_not_run(folder: Path) -> None:
    text = """<launch><test test-name="drives" pkg="rosbag" type="record" args="-a"/>
      <test test-name="lives" pkg="nowhere" type="lives.py"/></launch>"""
    found = staged(folder, text)
    assert (found.stand_ins.recordings, found.programs, found.notes) == ((), (), ())
    assert len(staged(folder, text.replace("<test test-name", "<node name")).stand_ins.recordings) == 1


def test_missing_display_file_is_reported_where_it_is_written(folder: Path) -> None:
    """rviz shows the error in a dialog and continues."""
    (folder / "robot.rviz").write_text("")
    node = '<node pkg="rviz" type="rviz" name="rviz" args="{}$(dirname)/{}"/>'
    assert staged(folder, f"<launch>{node.format('-d ', 'robot.rviz')}</launch>").notes == ()
    for option in ("-d ", "--display-config="):
        (note,) = staged(folder, f"<launch>\n{node.format(option, 'robto.rviz')}</launch>").notes
        assert (note.code, note.hint) == ("L059", "did you mean 'robot.rviz'?")
        assert note.message == f"{folder / 'robto.rviz'} does not exist: rviz shows its default displays"
        assert note.origin is not None
        assert (note.origin.span.line, note.origin.span.text[-20:]) == (2, "$(dirname)/robto.rviz"[-20:])
