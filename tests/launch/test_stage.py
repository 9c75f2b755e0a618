"""What a plan comes to without ROS."""

from pathlib import Path

import pytest

from kbot.launch import read_launch
from kbot.launch.stage import Stage, stage
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
    assert found == Stage(str(folder / "r.xacro"), {}, True, "worlds/boxes.world", ())


def test_the_parameter_that_is_spawned_is_the_robot(folder: Path) -> None:
    found = staged(folder, GAZEBO.format(passed="", param="other", more=""))
    assert (found.path, found.arguments) == (str(folder / "s.xacro"), {"side": "left"})
    assert found.world == "worlds/empty.world"


def test_a_start_elsewhere_is_told_not_to_be_done(folder: Path) -> None:
    found = staged(folder, GAZEBO.format(passed="", param="other", more=" -x 1 -Y 0.5"))
    (note,) = found.notes
    assert (note.code, note.is_error) == ("L059", False)
    assert note.message.startswith("-x, -Y")


def test_without_a_spawner_the_robot_is_shown_and_not_simulated(folder: Path) -> None:
    text = '<launch><param name="robot_description" command="xacro $(dirname)/r.xacro"/></launch>'
    assert staged(folder, text) == Stage(str(folder / "r.xacro"), {}, False, "empty", ())
