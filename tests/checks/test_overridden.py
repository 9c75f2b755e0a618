"""Rules and fixes use the current value of a property: that of the caller if the property is overridden."""

from pathlib import Path

import pytest

import kbot
from kbot.checks import check_file
from kbot.text import Diagnostic

LINK = """<link name="{name}"><inertial><mass value="1"/>{tensor}</inertial>
  <collision>{shape}</collision></link>"""
TENSOR = '<inertia ixx="{0}" ixy="0" ixz="0" iyy="{1}" iyz="0" izz="{2}"/>'
BOX = '<geometry><box size="0.1 0.1 0.02"/></geometry>'
WHEEL = '<origin rpy="1.5707963 0 0"/><geometry><cylinder radius="${wheel_radius}" length="0.02"/></geometry>'
JOINT = """<joint name="{name}_joint" type="continuous"><parent link="base"/><child link="{name}"/>
  <origin xyz="0 {y} 0"/><axis xyz="0 1 0"/></joint>"""
TURNED = TENSOR.format("0.0003396", "0.0006125", "0.0003396")
"""kg m^2 of a solid wheel of 1 kg, radius 0.035 m, width 0.02 m: m (3 r^2 + h^2) / 12 and m r^2 / 2."""
ROBOT = f"""<robot name="r" xmlns:xacro="http://www.ros.org/wiki/xacro">
<xacro:property name="wheel_radius" value="0.035"/>
<xacro:property name="wheel_separation" value="0.15"/>
{LINK.format(name="base", tensor=TENSOR.format("0.00087", "0.00087", "0.0017"), shape=BOX)}
{LINK.format(name="left", tensor=TURNED, shape=WHEEL)}{JOINT.format(name="left", y=0.087)}
{LINK.format(name="right", tensor=TURNED, shape=WHEEL)}{JOINT.format(name="right", y=-0.087)}
</robot>"""


@pytest.fixture
def robot(tmp_path: Path) -> Path:
    file = tmp_path / "r.xacro"
    file.write_text(ROBOT)
    return file


def found(robot: Path, code: str, **properties: str) -> list[Diagnostic]:
    return [d for d in check_file(str(robot), properties=properties) if d.code == code]


def test_wheel_sizes_are_compared_with_the_value_in_use(robot: Path) -> None:
    """The wheels are made of `wheel_radius` and are 0.174 m apart."""
    assert found(robot, "D106") == found(robot, "D106", wheel_radius="0.05") == []
    assert "not 0.15:" in found(robot, "D105")[0].message
    assert "not 0.2:" in found(robot, "D105", wheel_separation="0.2")[0].message
    assert found(robot, "D105", wheel_separation="0.174") == []


def test_load_warns_of_the_value_in_use_only(robot: Path) -> None:
    with pytest.warns(kbot.DescriptionWarning) as warned:
        kbot.load(robot, wheel_radius=0.05, wheel_separation=0.174)
    assert not [w for w in warned if "[D10" in str(w.message)]


def test_a_property_that_is_overridden_does_not_change_after_its_use(robot: Path) -> None:
    again = '<xacro:property name="wheel_radius" value="0.04"/></robot>'
    robot.write_text(ROBOT.replace("</robot>", again))
    assert len(found(robot, "S106")) == 1
    assert found(robot, "S106", wheel_radius="0.05") == []


def test_no_fix_writes_numbers_of_an_overridden_robot(robot: Path) -> None:
    """The tensor in the file fits the wheels in the file; that of an overridden wheel would be wrong
    there."""
    wrong = found(robot, "I109", wheel_radius="0.5")
    assert wrong
    assert [d.fix for d in wrong] == [None] * len(wrong)
    robot.write_text(ROBOT.replace("0.035", "0.5"))
    assert [d.fix.title for d in found(robot, "I109") if d.fix] == [
        "write the tensor of a solid of its shape"
    ] * len(wrong)
