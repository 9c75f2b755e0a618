"""Tests the command `kbot launch`."""

import os
import signal
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import pytest
import yaml

from kbot.cli.main import run

ROBOT = """<robot name="r" xmlns:xacro="http://ros.org/wiki/xacro">
  <xacro:arg name="width" default="1"/><link name="base"/>
</robot>
"""
LAUNCH = """<launch>
  <arg name="width" default="2" doc="how wide"/>
  <param name="robot_description" command="$(find xacro)/xacro $(dirname)/r.xacro width:=$(arg width)"/>
  <node pkg="robot_state_publisher" type="robot_state_publisher" name="rsp"/>
  <node pkg="rviz" type="rviz" name="rviz" args="-d $(dirname)/x.rviz" required="true"/>
</launch>
"""


@pytest.fixture
def launch(tmp_path: Path) -> Path:
    (tmp_path / "package.xml").write_text("<package><name>mine</name></package>")
    (tmp_path / "r.xacro").write_text(ROBOT)
    (tmp_path / "x.rviz").write_text("")
    file = tmp_path / "r.launch"
    file.write_text(LAUNCH)
    return file


def output(capsys: pytest.CaptureFixture[str]) -> tuple[str, str]:
    captured = capsys.readouterr()
    return captured.out, captured.err


def test_a_dry_run_lists_the_replacement_of_each_node(
    launch: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert run(["launch", str(launch), "width:=3", "--dry-run"]) == 0
    out, err = output(capsys)
    assert err == ""
    assert "/rsp   robot_state_publisher/robot_state_publisher  the workbench's transforms  r.launch:4" in out
    assert f"robot: {launch.parent / 'r.xacro'} width:=3" in out


def test_a_dry_run_without_a_simulation_promises_no_controllers(
    launch: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """As husky_control's control.launch, which is also run on the real robot."""
    spawner = '<node pkg="controller_manager" type="spawner" name="spawner" args="arm"/>'
    arm = "<rosparam>arm: {type: position_controllers/JointPositionController, joint: a}</rosparam>"
    launch.write_text(LAUNCH.replace("</launch>", f"{spawner}{arm}</launch>"))
    assert run(["launch", str(launch), "--dry-run"]) == 0
    assert "controller_manager/spawner                   not run: no node spawns a robot" in output(capsys)[0]
    words = "-urdf -model r -param robot_description"
    gazebo = f'<node pkg="gazebo_ros" type="spawn_model" name="s" args="{words}"/>'
    launch.write_text(LAUNCH.replace("</launch>", f"{spawner}{arm}{gazebo}</launch>"))
    run(["launch", str(launch), "--dry-run"])
    assert "the controllers of KBot's simulation" in output(capsys)[0]


def test_the_command_that_applies_fixes_is_printed_once(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    launch = tmp_path / "a.launch"
    node = '<node name="{}" pkg="robot_state_publisher" type="state_publisher"/>'
    launch.write_text(f"<launch>{node.format('a')}\n{node.format('b')}</launch>\n")
    assert run(["launch", str(launch), "--dry-run"]) == 1
    assert output(capsys)[1].count(f"kbot check --fix {launch}\n") == 1
    assert run(["check", "--fix", str(launch)]) == 0
    assert launch.read_text().count('type="robot_state_publisher"') == 2


def test_a_folder_lists_its_launch_files(launch: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert run(["launch", str(launch.parent)]) == 2
    usage = f"Write kbot launch FILE. Its launch files: {launch}"
    assert output(capsys)[1] == f"error: {launch.parent} is a folder. {usage}\n"
    launch.unlink()
    assert run(["launch", str(launch.parent)]) == 2
    assert "is a folder. It has no launch files." in output(capsys)[1]


def test_a_package_and_a_file_name_are_a_launch_file(
    launch: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    words = ["launch", "mine", "r.launch", "--files", "--package-path", str(launch.parent)]
    assert run(words) == 0
    assert output(capsys)[0] == f"{launch}\n"


def test_a_package_without_a_file_lists_its_launch_files(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    for word in ("kbot_description", "kbot"):
        assert run(["launch", word, "--ros-args"]) == 2
        error = output(capsys)[1]
        usage = f"Write kbot launch {word} FILE. Its launch files: kbot_base_rviz.launch"
        assert f"error: {word} is a package. {usage}" in error
        assert "does not exist" not in error
    assert run(["launch", "kbot", "kbot_base_rviz"]) == 2
    has = "the package 'kbot' has no launch file kbot_base_rviz. It has: kbot_base_rviz.launch"
    assert has in output(capsys)[1]
    assert run(["launch", "quadruped_zebra"]) == 2
    assert "quadruped_zebra is not a file or package. Write kbot launch FILE" in output(capsys)[1]
    assert run(["launch", "kbot_descripton"]) == 2
    assert "did you mean 'kbot_description'?" in output(capsys)[1]
    assert run(["launch", "kbot", "kbot_base_rviz.launch", "--nodes"]) == 0


@pytest.fixture
def by_hand(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A learner's folder in the working directory: without package.xml, and with a misspelled name."""
    monkeypatch.chdir(tmp_path)
    folder = tmp_path / "kbot_desciption"
    (folder / "launch").mkdir(parents=True)
    (folder / "launch/x.launch").write_text("<launch/>")
    return folder


def test_a_folder_without_package_xml_is_not_a_package(
    by_hand: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert run(["launch", by_hand.name, "x.launch"]) == 2
    assert output(capsys)[1] == (
        "error: the folder kbot_desciption has no package.xml: add one, or give the launch file by its path: "
        "kbot launch kbot_desciption/launch/x.launch\n"
    )
    assert run(["launch", by_hand.name, "y.launch"]) == 2
    assert "the folder kbot_desciption has no launch file y.launch. It has: x.launch" in output(capsys)[1]
    (by_hand / "package.xml").write_text("<package><name>other</name></package>")
    assert run(["launch", by_hand.name, "x.launch"]) == 2
    assert "the package.xml of the folder kbot_desciption has the name 'other'" in output(capsys)[1]


@pytest.mark.parametrize("word", ["{}/", "./{}", "./{}/", "{}/../{}"])
def test_a_package_may_be_the_path_of_its_folder(
    by_hand: Path, word: str, capsys: pytest.CaptureFixture[str]
) -> None:
    word = word.format(by_hand.name, by_hand.name)
    assert run(["launch", word, "x.launch", "--files"]) == 0
    assert Path(output(capsys)[0].strip()).resolve() == by_hand / "launch/x.launch"
    assert run(["launch", f"./no/{word}", "x.launch"]) == 2
    assert f"error: ./no/{word} is not a folder\n" == output(capsys)[1]


def test_a_package_s_hint_names_its_folder_without_package_xml(
    by_hand: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    launch = by_hand / "launch/x.launch"
    launch.write_text(f"<launch><include file='$(find {by_hand.name})/launch/y.launch'/></launch>")
    for here, shown in ((by_hand.parent, by_hand.name), (by_hand, str(by_hand))):
        monkeypatch.chdir(here)
        run(["check", str(by_hand)])
        out = output(capsys)[0]
        assert "the package 'kbot_desciption' is not found [L012]" in out
        assert f"the folder {shown} has no package.xml: add one\n" in out
        assert "kbot_description" not in out


def test_several_packages_of_one_name(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    for folder in ("a", "b"):
        (tmp_path / folder).mkdir()
        (tmp_path / folder / "package.xml").write_text("<package><name>bot</name></package>")
        (tmp_path / folder / "x.launch").write_text("<launch/>")
    text = f"several packages are named 'bot': {tmp_path / 'a'}, {tmp_path / 'b'}"
    for words in (
        ["launch", "bot", "x.launch", "--nodes"],
        ["launch", "bot"],
        ["check", "bot"],
        ["try", "bot"],
    ):
        assert run(words) == 2, words
        assert text in "".join(output(capsys))
    # a variable and an option decide
    monkeypatch.setenv("ROS_PACKAGE_PATH", f"{tmp_path / 'b'}{os.pathsep}{tmp_path / 'a'}")
    assert run(["launch", "bot", "x.launch", "--files"]) == 0
    assert output(capsys)[0].strip() == str(tmp_path / "b/x.launch")
    assert run(["launch", "bot", "x.launch", "--files", "--package-path", str(tmp_path / "a")]) == 0
    assert output(capsys)[0].strip() == str(tmp_path / "a/x.launch")


@pytest.mark.parametrize("text", ['<xacro:include filename="$(find bot)/x.xacro"/>', '<m v="$(find bot)"/>'])
def test_a_description_needs_one_package_of_several(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str], text: str
) -> None:
    """An include is not skipped as that of an absent package is."""
    monkeypatch.chdir(tmp_path)
    for folder in ("a", "b"):
        (tmp_path / folder).mkdir()
        (tmp_path / folder / "package.xml").write_text("<package><name>bot</name></package>")
    robot = tmp_path / "robot.xacro"
    robot.write_text(
        f'<robot name="r" xmlns:xacro="http://www.ros.org/wiki/xacro">\n{text}\n<link name="a"/></robot>'
    )
    assert run(["check", str(robot)]) == 1
    out = output(capsys)[0]
    assert "robot.xacro:2:" in out
    assert f"error: several packages are named 'bot': {tmp_path / 'a'}, {tmp_path / 'b'} [X114]" in out


def test_a_mesh_of_one_of_several_packages_is_an_error(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    for folder in ("a", "b"):
        (tmp_path / folder).mkdir()
        (tmp_path / folder / "package.xml").write_text("<package><name>bot</name></package>")
    mesh = '<visual><geometry><mesh filename="package://bot/m.stl"/></geometry></visual>'
    (tmp_path / "robot.urdf").write_text(f'<robot name="r"><link name="a">\n{mesh}</link></robot>')
    assert run(["check", "robot.urdf"]) == 1
    assert "several packages are named 'bot': " in "".join(output(capsys))


def test_parameters_are_dumped_as_yaml(launch: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert run(["launch", str(launch), "--dump-params"]) == 0
    params = yaml.safe_load(output(capsys)[0])
    assert list(params) == ["/robot_description"]
    assert '<link name="base"/>' in params["/robot_description"]


def test_nodes_arguments_and_command_lines(launch: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert run(["launch", str(launch), "--nodes"]) == 0
    assert output(capsys)[0] == "/rsp\n/rviz\n"
    assert run(["launch", str(launch), "--ros-args"]) == 0
    assert output(capsys)[0] == 'Optional Arguments:\n  width (default "2"): how wide\n'
    assert run(["launch", str(launch), "--args", "rviz"]) == 0
    assert output(capsys)[0] == f"rviz/rviz -d {launch.parent / 'x.rviz'} __name:=rviz\n"
    assert run(["launch", str(launch), "--args", "rvis"]) == 2
    assert "did you mean '/rviz'?" in output(capsys)[1]


def test_a_node_without_a_replacement_is_reported_at_its_line(
    launch: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    launch.write_text(LAUNCH.replace("</launch>", '<node pkg="absent" type="t" name="n"/></launch>'))
    assert run(["launch", str(launch), "--dry-run"]) == 1
    out, err = output(capsys)
    assert (
        f"{launch}:6:26: warning: /n (absent/t) is not run: the package 'absent' is not found [L055]" in err
    )
    assert "not run" in out


def test_a_required_node_that_cannot_run_ends_the_launch(
    launch: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    node = '<node pkg="absent" type="t" name="n" required="true"/></launch>'
    launch.write_text(LAUNCH.replace("</launch>", node))
    assert run(["launch", str(launch), "--no-browser"]) == 2
    assert "error: /n (absent/t) is not run" in output(capsys)[1]


def test_a_launch_file_without_a_robot_is_reported(launch: Path, capsys: pytest.CaptureFixture[str]) -> None:
    launch.write_text("<launch/>")
    assert run(["launch", str(launch), "--no-browser"]) == 2
    assert "nothing to show" in output(capsys)[1]


@pytest.mark.parametrize("verb", ["launch", "sim"])
def test_a_robot_in_an_sdf_file_is_one_error(
    verb: str, launch: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    model = launch.parent / "r.sdf"
    model.write_text('<sdf version="1.9"><model name="r"><link name="l"/></model></sdf>')
    words = "-sdf -param robot_description -model r"
    spawner = f'<node pkg="gazebo_ros" type="spawn_model" name="s" args="{words}"/>'
    described = '<param name="robot_description" textfile="$(dirname)/r.sdf"/>'
    launch.write_text(f"<launch>{described}{spawner}</launch>")
    file = launch if verb == "launch" else model
    assert run([verb, str(file), "--no-browser"]) == 2
    out, err = output(capsys)
    assert out == ""
    assert (err.count("error:"), err.count("warning:")) == (1, 0)
    assert "URDF" in err


def test_the_reason_why_there_is_no_robot_is_reported(
    launch: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    spawner = '<node pkg="gazebo_ros" type="spawn_model" name="s" args="-param robot_description -model r"/>'
    launch.write_text(f"<launch>{spawner}</launch>")
    assert run(["launch", str(launch), "--no-browser"]) == 2
    assert "/s spawns nothing" in output(capsys)[1]
    publisher = '<node pkg="robot_state_publisher" exec="robot_state_publisher">{}</node>'
    robot = "<param name='robot_description' value=\"$(command 'xacro none.xacro')\" type='str'/>"
    ros2 = launch.with_suffix(".launch.xml")
    ros2.write_text(f"<launch>{publisher.format(robot)}</launch>")
    assert run(["launch", str(ros2), "--no-browser"]) == 2
    assert "none.xacro does not exist [F001]" in output(capsys)[1]


def test_a_broken_robot_is_reported_once_at_its_line(
    launch: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    (launch.parent / "r.xacro").write_text(ROBOT.replace('"base"', '"${bse}"'))
    assert run(["launch", str(launch), "--no-browser"]) == 2
    assert output(capsys)[1].count("error: ") == 1


def test_a_robot_that_is_not_xml_is_reported_alike_by_every_verb(
    launch: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    file = launch.parent / "r.xacro"
    file.write_text('<robot>\n  <xmlns:xacro="http://www.ros.org/wiki/xacro" name="r">\n</robot>\n')
    errors = []
    for words in (["check", str(file)], ["launch", str(launch), "--dry-run"], ["expand", str(file)]):
        assert run(words) == 2
        out, err = output(capsys)
        frame = (out + err).partition("error: ")[2].partition("  = fix")[0]
        errors.append(frame)
    assert "the root element is split in two" in errors[0]
    assert len(set(errors)) == 1


def test_programs_run_only_with_allow_commands(launch: Path, capsys: pytest.CaptureFixture[str]) -> None:
    command = f'"{sys.executable}" -c "print(42)"'.replace('"', "&quot;")
    launch.write_text(f'<launch><param name="answer" command="{command}"/></launch>')
    assert run(["launch", str(launch), "--dump-params"]) == 2
    assert "[L040]" in output(capsys)[1]
    assert run(["launch", str(launch), "--dump-params", "--allow-commands"]) == 0
    assert yaml.safe_load(output(capsys)[0]) == {"/answer": 42}


@pytest.mark.skipif(sys.platform == "win32", reason="signals are sent otherwise on Windows")
def test_the_corrected_chapter_runs_in_the_workbench(
    shared: Path, start_kbot: Callable[..., subprocess.Popen[str]]
) -> None:
    file = shared / "chapter/corrected/kbot_description/launch/kbot_base_rviz.launch"
    running = start_kbot("launch", file, "--no-browser", "--port", "0")
    assert running.stdout is not None
    lines = []
    while not lines or "http://127.0.0.1:" not in lines[-1]:
        lines.append(running.stdout.readline())
        assert lines[-1], running.communicate()
    running.send_signal(signal.SIGINT)
    _, err = running.communicate(timeout=60)
    assert (running.returncode, err) == (0, "")
    assert any("rviz/rviz" in line and "the workbench" in line for line in lines)
