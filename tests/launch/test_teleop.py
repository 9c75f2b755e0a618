"""The settings of teleop_twist_keyboard, and the note about gamepad nodes."""

from pathlib import Path

from kbot.ros.launch import read_launch, read_launch_2
from kbot.ros.launch.staging import Stage, stage
from kbot.ros.nodes.teleop_twist_keyboard import Keys
from kbot.text import Severity
from kbot.xacro import Packages


def staged(folder: Path, body: str) -> Stage:
    file = folder / "a.launch"
    file.write_text(f"<launch>{body}</launch>")
    return stage(read_launch(str(file), packages=Packages(around=str(file))).require())


def staged_2(folder: Path, body: str) -> Stage:
    file = folder / "a.launch.xml"
    file.write_text(f"<launch>{body}</launch>")
    return stage(read_launch_2(str(file), packages=Packages(around=str(file))).require())


def test_keys_have_speeds_and_remap(tmp_path: Path) -> None:
    node = (
        '<group ns="b"><node pkg="teleop_twist_keyboard" type="teleop_twist_keyboard.py" name="k"'
        ' args="_turn:=0.7"><param name="speed" value="0.2"/>'
        '<remap from="cmd_vel" to="/a/drive"/></node></group>'
    )
    assert staged(tmp_path, node).stand_ins.keys == Keys("/a/drive", 0.2, 0.7)


def test_gamepad_nodes_get_one_note(tmp_path: Path) -> None:
    one = staged(
        tmp_path,
        '<node pkg="joy" type="joy_node" name="j"/>\n'
        '<node pkg="teleop_twist_joy" type="teleop_node" name="t"/>',
    )
    two = staged_2(
        tmp_path,
        '<node pkg="joy_linux" exec="joy_linux_node"/><node pkg="teleop_twist_joy" exec="teleop_node"/>',
    )
    for found, name in ((one, "joy/joy_node"), (two, "joy_linux/joy_linux_node")):
        (note,) = found.notes
        assert note.origin is not None
        assert (note.code, note.severity, note.origin.span.line) == ("L055", Severity.INFO, 1)
        assert note.message == f"node {name} is not run: the page reads gamepads"


def test_wrong_parameter_is_reported_at_its_line(tmp_path: Path) -> None:
    node = (
        '<node pkg="teleop_twist_keyboard" type="teleop_twist_keyboard.py" name="k">\n'
        '<param name="speed" value="fast" type="str"/>\n</node>'
    )
    found = staged(tmp_path, node)
    (note,) = found.notes
    assert note.origin is not None
    assert (note.code, note.origin.span.line) == ("L062", 2)
    assert note.message == "speed must be a finite number, not 'fast'"
    assert found.stand_ins.keys == Keys("/cmd_vel", 0.5, 1.0)
