"""Launch files with several robots: names, namespaces and frames."""

from pathlib import Path

import pytest

from kbot.ros.launch import read_launch, read_launch_2
from kbot.ros.launch.staging import Stage, stage
from kbot.xacro import Packages

ROBOT = '<param name="robot_description" command="xacro $(dirname)/r.xacro"/>'
SPAWN = '<node pkg="gazebo_ros" type="spawn_model" name="{}" args="-urdf -param /robot_description {}"/>'


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    (tmp_path / "r.xacro").write_text('<robot name="r"><link name="a"/></robot>')
    return tmp_path


def staged(folder: Path, body: str) -> Stage:
    file = folder / "a.launch"
    file.write_text(f"<launch>{ROBOT}{body}</launch>")
    return stage(read_launch(str(file), packages=Packages(around=str(file))).require())


def names(found: Stage) -> list[tuple[str, str, str]]:
    return [(o.spawn.model, o.spawn.namespace, o.frame_prefix) for o in found.robots]


def test_robot_gets_the_namespace_of_its_spawner_group(folder: Path) -> None:
    one = SPAWN.format("s", "-model A -y 1")
    two = SPAWN.format("s", "-model B -y -1")
    found = staged(folder, f'<group ns="a">{one}</group><group ns="b">{two}</group>')
    assert names(found) == [("A", "a", "a/"), ("B", "b", "b/")]
    assert [o.spawn.y for o in found.robots[1:]] == [-1.0]
    assert found.notes == ()


def test_robot_namespace_option_overrides_the_group(folder: Path) -> None:
    body = SPAWN.format("s", "-model A -robot_namespace fleet/a") + SPAWN.format("t", "-model B")
    found = staged(folder, f'<group ns="b">{body}</group>')
    assert names(found) == [("A", "fleet/a", "fleet/a/"), ("B", "b", "b/")]


def test_frames_of_a_single_robot_have_no_prefix(folder: Path) -> None:
    found = staged(folder, SPAWN.format("s", "-model A -robot_namespace a"))
    assert names(found) == [("A", "a", "")]


def test_tf_prefix_of_the_namespace_is_the_frame_prefix(folder: Path) -> None:
    robot = SPAWN.format("s", "-model {0}")
    group = '<group ns="{0}"><param name="tf_prefix" value="{0}_tf"/>' + robot + "</group>"
    assert names(staged(folder, group.format("a") + group.format("b"))) == [
        ("a", "a", "a_tf/"),
        ("b", "b", "b_tf/"),
    ]


def test_robots_that_share_topics_are_reported_at_the_second(folder: Path) -> None:
    found = staged(folder, SPAWN.format("s", "-model A") + "\n" + SPAWN.format("t", "-model B"))
    (note,) = found.notes
    assert names(found) == [("A", "", ""), ("B", "", "B/")]
    assert note.origin is not None
    assert (note.code, note.is_error, note.origin.span.line) == ("L063", False, 2)


def test_second_robot_with_the_same_name_is_not_spawned(folder: Path) -> None:
    found = staged(folder, SPAWN.format("s", "-model A") + SPAWN.format("t", "-model A"))
    assert names(found) == [("A", "", "")]
    assert [note.code for note in found.notes] == ["L062"]


def test_create_uses_the_node_namespace_or_the_model_name(folder: Path) -> None:
    file = folder / "a.launch.xml"
    robot = (
        '<node pkg="robot_state_publisher" exec="robot_state_publisher" namespace="a">'
        f'<param name="robot_description" value="$(command \'xacro {folder}/r.xacro\')" type="str"/>'
        '<param name="frame_prefix" value="one_" type="str"/></node>'
    )
    create = '<node pkg="ros_gz_sim" exec="create" {} args="-topic /a/robot_description -name {}"/>'
    creators = create.format('namespace="a"', "x") + create.format("", "y")
    file.write_text(f"<launch>{robot}{creators}</launch>")
    found = stage(read_launch_2(str(file), packages=Packages(around=str(file))).require())
    assert names(found) == [("x", "a", "one_"), ("y", "y", "y/")]


def test_controllers_belong_to_the_robot_with_their_namespace(folder: Path) -> None:
    (folder / "c.yaml").write_text("c: {type: position_controllers/JointPositionController, joint: j}\n")
    robot = SPAWN.format("s", "-model {0}")
    controller = (
        '<rosparam command="load" file="$(dirname)/c.yaml"/>'
        '<node pkg="controller_manager" type="spawner" name="c" args="c"/>'
    )
    group = '<group ns="{0}">' + robot + controller + "</group>"
    found = staged(folder, group.format("a") + group.format("b"))
    assert [[c.name for c in robot.controllers] for robot in found.robots] == [["/a/c"], ["/b/c"]]


def test_sdf_model_is_spawned_beside_the_robot(folder: Path) -> None:
    crate = SPAWN.format("t", "-sdf -file $(dirname)/crate.sdf -model crate -x 2 -z 0.1")
    found = staged(
        folder, crate.replace("-urdf -param /robot_description", "") + SPAWN.format("s", "-model A")
    )
    assert names(found) == [("A", "", "")]
    (model,) = found.models
    assert (model.path, model.spawn.model) == (str(folder / "crate.sdf"), "crate")
    assert (model.spawn.x, model.spawn.z) == (2.0, 0.1)


def test_sdf_model_of_the_robot_gives_the_robot_its_pose(folder: Path) -> None:
    (folder / "r.urdf").write_text(
        '<robot name="r"><link name="base"/><link name="wheel"/><joint name="j" type="fixed">'
        '<parent link="base"/><child link="wheel"/></joint></robot>'
    )
    (folder / "same.sdf").write_text(
        '<sdf version="1.7"><model name="r"><link name="base"/><link name="wheel"/></model></sdf>'
    )
    (folder / "other.sdf").write_text('<sdf version="1.7"><model name="o"><link name="box"/></model></sdf>')
    described = '<param name="robot_description" textfile="$(dirname)/r.urdf"/>'
    spawner = SPAWN.format("s", "-sdf -file $(dirname)/{}.sdf -model burger -x 2 -y -0.5")
    spawner = spawner.replace("-urdf -param /robot_description", "")
    found = staged(folder, described + spawner.format("same"))
    assert (found.robots[0].path, found.robots[0].spawn.x, found.robots[0].spawn.y) == (
        str(folder / "r.urdf"),
        2.0,
        -0.5,
    )
    assert (found.robots[0].spawn.model, found.models) == ("burger", ())
    (note,) = (n for n in found.notes if n.code == "L063")
    assert "same.sdf is the same robot as r.urdf" in note.message
    found = staged(folder, described + spawner.format("other"))
    assert ([m.path for m in found.models], found.robots[0].spawn.x) == ([str(folder / "other.sdf")], 0.0)


def test_description_with_xacro_in_comments_is_a_robot(folder: Path) -> None:
    (folder / "r.urdf").write_text('<robot name="r"><!-- <xacro:wheel/>\n --><link name="a"/></robot>')
    described = '<param name="robot_description" textfile="$(dirname)/r.urdf"/>'
    assert staged(folder, described).robots[0].path == str(folder / "r.urdf")


def test_reason_why_a_simulated_launch_has_no_robot_is_at_its_line(folder: Path) -> None:
    (folder / "m.sdf").write_text('<sdf version="1.7"><model name="m"><link name="l"/></model></sdf>')
    gazebo = '<include file="$(find gazebo_ros)/launch/empty_world.launch"/>'
    model = '<param name="robot_description" textfile="$(dirname)/m.sdf"/>'
    for body, line, message in (
        (gazebo, 2, "the world worlds/empty.world is not simulated: no node spawns a robot"),
        (f"{gazebo}\n{model}", 3, "/robot_description is an SDF model, which KBot does not run as a robot"),
    ):
        file = folder / "b.launch"
        file.write_text(f"<launch>\n{body}\n</launch>")
        (note,) = stage(read_launch(str(file), packages=Packages(around=str(file))).require()).notes
        assert note.origin is not None
        assert (note.code, note.origin.span.line, note.message) == ("L063", line, message)
