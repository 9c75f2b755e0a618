"""What teleop_twist_keyboard, joy_node and teleop_twist_joy are told."""

from pathlib import Path

import pytest

from kbot.ros.launch import read_launch, read_launch_2
from kbot.ros.launch.node_settings.teleop import Driver, Gamepad, Stick
from kbot.ros.launch.staging import Stage, stage
from kbot.ros.nodes.teleop_twist_keyboard import Keys
from kbot.xacro import Packages


def staged(folder: Path, body: str) -> Stage:
    file = folder / "a.launch"
    file.write_text(f"<launch>{body}</launch>")
    return stage(read_launch(str(file), packages=Packages(around=str(file))).require())


def staged_2(folder: Path, body: str) -> Stage:
    file = folder / "a.launch.xml"
    file.write_text(f"<launch>{body}</launch>")
    return stage(read_launch_2(str(file), packages=Packages(around=str(file))).require())


def test_keys_with_their_speeds_and_remap(tmp_path: Path) -> None:
    node = (
        '<group ns="b"><node pkg="teleop_twist_keyboard" type="teleop_twist_keyboard.py" name="k"'
        ' args="_turn:=0.7"><param name="speed" value="0.2"/>'
        '<remap from="cmd_vel" to="/a/drive"/></node></group>'
    )
    assert staged(tmp_path, node).by_hand.keys == Keys("/a/drive", 0.2, 0.7)


def test_defaults_of_ros_1_and_of_ros_2(tmp_path: Path) -> None:
    """teleop_twist_joy 0.1 and 2.4, joy 1.15 and 3.3."""
    one = staged(
        tmp_path,
        '<node pkg="joy" type="joy_node" name="j"/>'
        '<node pkg="teleop_twist_joy" type="teleop_node" name="t"/>',
    )
    assert one.by_hand.gamepads == (Gamepad("/joy", "/dev/input/js0", 0.05, 0.0),)
    assert one.by_hand.drivers == (
        Driver("/joy", "/cmd_vel", Stick(1, 0.5, 1.0), Stick(0, 0.5, 0.5), 0, -1, True),
    )
    two = staged_2(
        tmp_path,
        '<node pkg="joy" exec="joy_node"/><node pkg="teleop_twist_joy" exec="teleop_node"/>',
    )
    assert two.by_hand.gamepads == (Gamepad("/joy", "/dev/input/js0", 0.05, 20.0),)
    assert two.by_hand.drivers == (
        Driver("/joy", "/cmd_vel", Stick(5, 0.5, 1.0), Stick(2, 0.5, 1.0), 5, -1, True),
    )
    assert one.notes == two.notes == ()


def test_parameters_flat_as_maps_and_nested(tmp_path: Path) -> None:
    flat = """<node pkg="teleop_twist_joy" type="teleop_node" name="t"><rosparam>
      {axis_linear: 3, scale_linear: 0.7, scale_linear_turbo: 1.5, axis_angular: 2, scale_angular: 0.4,
       enable_button: 8, enable_turbo_button: 10}</rosparam></node>"""
    maps = """<node pkg="teleop_twist_joy" type="teleop_node" name="t"><rosparam>
      {axis_linear: {x: 3}, scale_linear: {x: 0.7}, scale_linear_turbo: {x: 1.5}, axis_angular: {yaw: 2},
       scale_angular: {yaw: 0.4}, enable_button: 8, enable_turbo_button: 10}</rosparam></node>"""
    wanted = Driver("/joy", "/cmd_vel", Stick(3, 0.7, 1.5), Stick(2, 0.4, 0.4), 8, 10, True)
    assert staged(tmp_path, flat).by_hand.drivers == staged(tmp_path, maps).by_hand.drivers == (wanted,)
    nested = """<node pkg="teleop_twist_joy" exec="teleop_node" namespace="r">
      <param name="axis_linear.x" value="1"/>
      <param name="require_enable_button" value="false"/><remap from="cmd_vel" to="drive"/></node>"""
    (driver,) = staged_2(tmp_path, nested).by_hand.drivers
    assert (driver.joy, driver.topic, driver.linear.axis) == ("/r/joy", "/r/drive", 1)
    assert not driver.requires_enable


def test_a_device_by_its_name_or_its_number(tmp_path: Path) -> None:
    node = '<node pkg="joy" type="joy_node" name="j"><param name="dev" value="/dev/input/js3"/></node>'
    assert staged(tmp_path, node).by_hand.gamepads[0].device == "/dev/input/js3"
    node = '<node pkg="joy" exec="joy_node"><param name="device_id" value="2"/></node>'
    assert staged_2(tmp_path, node).by_hand.gamepads[0].device == "/dev/input/js2"


@pytest.mark.parametrize(
    ("param", "said"),
    [
        (
            '<param name="scale_linear" value="fast" type="str"/>',
            "scale_linear is a finite number, not 'fast'",
        ),
        ('<param name="scale_liner" value="1"/>', "teleop_node has no parameter 'scale_liner'"),
    ],
)
def test_what_is_wrong_is_said_at_its_line(tmp_path: Path, param: str, said: str) -> None:
    found = staged(tmp_path, f'<node pkg="teleop_twist_joy" type="teleop_node" name="t">\n{param}\n</node>')
    (note,) = found.notes
    assert note.origin is not None
    assert (note.code, note.message, note.origin.span.line) == ("L062", said, 2)


@pytest.mark.parametrize("rate", ["1e-320", "0.009", "-1.0", "1e308"])
def test_a_rate_that_no_node_keeps_is_one_finding(tmp_path: Path, rate: str) -> None:
    param = f'<param name="autorepeat_rate" type="double" value="{rate}"/>'
    found = staged(tmp_path, f'<node pkg="joy" type="joy_node" name="j">\n{param}\n</node>')
    (note,) = found.notes
    assert note.origin is not None
    assert (note.code, note.origin.span.line) == ("L062", 2)
    assert note.message == f"autorepeat_rate is 0, or from 0.01 to 1000 Hz, not {float(rate):g}"
    assert found.by_hand.gamepads[0].repeat == 0.0
