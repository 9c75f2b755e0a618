"""What a plan comes to without ROS."""

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


def test_a_spawned_model_is_simulated_in_the_world_that_is_named(folder: Path) -> None:
    world = '<arg name="world_name" value="worlds/boxes.world"/>'
    found = staged(folder, GAZEBO.format(passed=world, param="robot_description", more=""))
    assert (found.robots[0].path, found.robots[0].arguments) == (str(folder / "r.xacro"), {})
    assert (found.is_simulated, found.gazebo.world, found.gazebo.paused, found.notes) == (
        True,
        "worlds/boxes.world",
        False,
        (),
    )


def test_the_parameter_that_is_spawned_is_the_robot(folder: Path) -> None:
    found = staged(folder, GAZEBO.format(passed="", param="other", more=""))
    assert (found.robots[0].path, found.robots[0].arguments) == (str(folder / "s.xacro"), {"side": "left"})
    assert found.gazebo.world == "worlds/empty.world"


def test_a_file_that_is_spawned_is_the_robot(folder: Path) -> None:
    found = staged(folder, GAZEBO.format(passed="", param="other", more=f" -file {folder}/r.xacro"))
    assert found.robots[0].path == str(folder / "r.xacro")


def test_the_start_is_where_the_spawner_is_told(folder: Path) -> None:
    more = " -x 1 -y -2.5 -z 0.3 -R 0.1 -P 0.2 -Y 0.5 -J arm 0.7 -J lift -1"
    found = staged(folder, GAZEBO.format(passed="", param="other", more=more))
    assert found.robots[0].spawn == SpawnRequest(
        1.0, -2.5, 0.3, 0.1, 0.2, 0.5, {"arm": 0.7, "lift": -1.0}, model="m"
    )
    assert found.notes == ()


def test_a_start_that_is_no_number_is_an_error_at_the_word(folder: Path) -> None:
    found = staged(folder, GAZEBO.format(passed="", param="other", more=" -x two"))
    (note,) = found.notes
    assert note.origin is not None
    assert (note.code, note.is_error, note.origin.span.text) == ("L062", True, "two")


@pytest.mark.parametrize("option", ["-package_to_model", "-reference_frame table::top"])
def test_what_a_spawner_is_told_in_vain_is_said(folder: Path, option: str) -> None:
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
def test_gazebo_s_arguments_count(
    folder: Path, passed: str, unpause: str, paused: bool, window: bool
) -> None:
    found = staged(folder, GAZEBO.format(passed=passed, param="other", more=unpause))
    assert (found.gazebo.paused, found.has_window) == (paused, window)


def test_who_looks_by_rviz_has_a_window_without_gazebo_s(folder: Path) -> None:
    rviz = '<node pkg="rviz" type="rviz" name="rviz"/></launch>'
    text = GAZEBO.format(passed='<arg name="gui" value="false"/>', param="other", more="")
    assert staged(folder, text.replace("</launch>", rviz)).has_window


def test_without_a_spawner_the_robot_is_shown_and_not_simulated(folder: Path) -> None:
    text = '<launch><param name="robot_description" command="xacro $(dirname)/r.xacro"/></launch>'
    found = staged(folder, text)
    assert (found.robots[0].path, found.is_simulated, found.gazebo.world) == (
        str(folder / "r.xacro"),
        False,
        "empty",
    )


def test_a_world_s_own_launch_file_names_it(folder: Path) -> None:
    text = '<launch><include file="$(find gazebo_ros)/launch/mud_world.launch"/></launch>'
    assert staged(folder, text).gazebo.world == "mud.world"


@pytest.mark.parametrize("how", ['textfile="$(dirname)/r.xacro"', 'command="cat $(dirname)/r.xacro"'])
def test_a_robot_that_is_read_as_it_stands_is_the_robot(folder: Path, how: str) -> None:
    launch = f'<launch><param name="robot_description" {how}/></launch>'
    assert staged(folder, launch).robots[0].path == str(folder / "r.xacro")
    (folder / "r.xacro").write_text('<robot xmlns:xacro="http://x" name="r"><xacro:a/></robot>')
    assert staged(folder, launch).robots == ()


def test_a_test_is_not_run(folder: Path) -> None:
    text = """<launch><test test-name="drives" pkg="rosbag" type="record" args="-a"/>
      <test test-name="lives" pkg="nowhere" type="lives.py"/></launch>"""
    found = staged(folder, text)
    assert (found.stand_ins.recordings, found.programs, found.notes) == ((), (), ())
    assert len(staged(folder, text.replace("<test test-name", "<node name")).stand_ins.recordings) == 1


def test_a_file_of_displays_that_is_not_there_is_told_where_it_is_written(folder: Path) -> None:
    """rviz says so in a box and goes on."""
    (folder / "robot.rviz").write_text("")
    node = '<node pkg="rviz" type="rviz" name="rviz" args="{}$(dirname)/{}"/>'
    assert staged(folder, f"<launch>{node.format('-d ', 'robot.rviz')}</launch>").notes == ()
    for option in ("-d ", "--display-config="):
        (note,) = staged(folder, f"<launch>\n{node.format(option, 'robto.rviz')}</launch>").notes
        assert (note.code, note.hint) == ("L059", "did you mean 'robot.rviz'?")
        assert note.message == f"{folder / 'robto.rviz'} does not exist: rviz shows its default displays"
        assert note.origin is not None
        assert (note.origin.span.line, note.origin.span.text[-20:]) == (2, "$(dirname)/robto.rviz"[-20:])
