"""Tests the Python API: `kbot.load` and the robot it returns."""

import math
import subprocess
import sys

import numpy as np
import pytest

import kbot

XACRO = """<?xml version="1.0"?>
<robot name="bot" xmlns:xacro="http://www.ros.org/wiki/xacro">
  <xacro:arg name="reach" default="1"/>
  <xacro:arg name="flip" default="false"/>
  <xacro:property name="height" value="2"/>
  <link name="base"/>
  <link name="arm"/>
  <joint name="swing" type="continuous">
    <origin xyz="$(arg reach) 0 ${height}"/>
    <parent link="base"/>
    <child link="arm"/>
    <axis xyz="0 0 1"/>
  </joint>
  <xacro:if value="$(arg flip)"><link name="flipped"/>
    <joint name="f" type="fixed"><parent link="base"/><child link="flipped"/></joint></xacro:if>
</robot>
"""


@pytest.fixture
def bot(tmp_path):
    path = tmp_path / "bot.xacro"
    path.write_text(XACRO)
    return path


def test_the_example_in_the_readme():
    robot = kbot.load("kbot", wheel_radius=0.04)
    assert next(iter(robot.links)) == "base_footprint"
    pose = robot.pose("left_wheel", in_frame="base_footprint", joints={"left_wheel_joint": math.pi / 2})
    assert pose.matrix.shape == (4, 4)
    assert pose.translation == pytest.approx([0, 0.087, 0.04])
    assert pose.rotation @ [1, 0, 0] == pytest.approx([0, 0, -1])


def test_keywords_are_arguments_and_properties_are_properties(bot):
    assert kbot.load(bot).pose("arm").translation == pytest.approx([1, 0, 2])
    assert kbot.load(bot, reach=3).pose("arm").translation == pytest.approx([3, 0, 2])
    assert kbot.load(str(bot), reach=np.float64(0.1)).pose("arm").translation[0] == 0.1
    assert kbot.load(bot, properties={"height": 5.5}).pose("arm").translation[2] == 5.5
    assert "flipped" in kbot.load(bot, flip=True).links
    assert "flipped" not in kbot.load(bot, arguments={"flip": False}).links


def test_a_wheel_radius_that_differs_in_a_plugin_is_a_warning(tmp_path):
    """With a radius of 0.1 m for wheels of 0.05 m, odometry doubles all distances."""
    wheels = "".join(
        f'<link name="{side}"><collision><origin rpy="1.5707963 0 0"/><geometry><cylinder '
        f'radius="${{radius}}" length="0.02"/></geometry></collision></link><joint name="{side}_joint" '
        f'type="continuous"><parent link="base"/><child link="{side}"/><origin xyz="0 {y} 0"/>'
        '<axis xyz="0 1 0"/></joint>'
        for side, y in (("left", 0.1), ("right", -0.1))
    )
    path = tmp_path / "bot.xacro"
    path.write_text(
        '<robot name="bot" xmlns:xacro="http://www.ros.org/wiki/xacro"><xacro:arg name="r" default="0.1"/>'
        f'<xacro:property name="radius" value="$(arg r)"/><link name="base"/>{wheels}<gazebo><plugin '
        'name="drive" filename="libgazebo_ros_diff_drive.so"><leftJoint>left_joint</leftJoint>'
        "<rightJoint>right_joint</rightJoint><wheelSeparation>0.2</wheelSeparation>"
        "<wheelDiameter>0.2</wheelDiameter></plugin></gazebo></robot>"
    )
    kbot.load(path)
    with pytest.warns(kbot.DescriptionWarning, match=r"\+100 % off \[D106\]"):
        kbot.load(path, r=0.05)


def test_a_keyword_that_is_not_an_argument_overrides_a_property_with_a_warning(bot):
    with pytest.warns(
        kbot.DescriptionWarning, match=r"^the property height is set to 5.5; .*bot.xacro:5 has 2$"
    ):
        robot = kbot.load(bot, height=5.5, reach=3)
    assert robot.pose("arm").translation == pytest.approx([3, 0, 5.5])
    assert robot.diagnostics == ()


def test_any_other_keyword_is_an_error_with_the_nearest_names(bot):
    nearest = r"'reech'; the nearest names are reach \(argument\), height \(property\)"
    with pytest.raises(kbot.DescriptionError, match=nearest):
        kbot.load(bot, reech=3)
    with pytest.raises(kbot.DescriptionError, match=r"top-level property 'wheel_radius'.*\n.*'wheel_width'"):
        kbot.load(bot, arguments={"wheel_radius": 3, "wheel_width": 2})
    with pytest.raises(kbot.KbotError, match="'height' is given twice"):
        kbot.load(bot, properties={"height": 2}, height=3)


@pytest.mark.parametrize(
    ("value", "message"),
    [(math.nan, "not finite"), (math.inf, "not finite"), (None, "NoneType"), ([1], "list")],
)
def test_values_that_xacro_cannot_take(bot, value, message):
    with pytest.raises(kbot.KbotError, match=f"argument 'reach' is .*{message}"):
        kbot.load(bot, reach=value)
    with pytest.raises(kbot.KbotError, match=f"property 'height' is .*{message}"):
        kbot.load(bot, properties={"height": value})


def test_the_exception_has_every_error_of_a_description(bot):
    bot.write_text(XACRO.replace("${height}", "${heigth}").replace('type="continuous"', 'type="contnuous"'))
    with pytest.raises(kbot.DescriptionError) as caught:
        kbot.load(bot)
    errors = [d for d in caught.value.diagnostics if d.is_error]
    assert [d.origin.span.line for d in sorted(errors, key=lambda d: d.origin.span.start)] == [8, 9]
    assert {d.origin.span.file for d in errors} == {str(bot)}


def test_a_missing_file_is_one_clear_error(tmp_path):
    with pytest.raises(kbot.DescriptionError, match="does not exist"):
        kbot.load(tmp_path / "none.xacro")


def test_frames_in_a_batch_and_back_to_urdf(bot):
    robot = kbot.load(bot)
    turns = robot.frames.batch(["swing"], np.linspace(0, 1, 5)[:, None])["arm"]
    assert turns[4] == pytest.approx(robot.pose("arm", joints={"swing": 1.0}).matrix)
    again = bot.with_suffix(".urdf")
    again.write_text(robot.to_urdf())
    assert kbot.load(again).pose("arm") == robot.pose("arm")


def test_the_drive_of_a_robot_without_wheels_has_a_reason(bot):
    drive = kbot.load(bot).drive
    assert isinstance(drive, kbot.kinematics.NoDrive)
    assert drive.reason == "no link has a mass or a collision shape: the description is only for display"


def test_importing_kbot_imports_no_large_library():
    code = (
        "import sys, kbot; print(sorted({'numpy', 'mujoco', 'yaml', 'click', 'trimesh'} & set(sys.modules)))"
    )
    result = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert result.stdout.strip() == "[]"


def test_every_public_name_exists():
    for name in kbot.__all__:
        assert getattr(kbot, name) is not None
    assert set(kbot.__all__) <= set(dir(kbot))
    with pytest.raises(AttributeError, match="has no attribute 'nonsense'"):
        _ = kbot.nonsense
