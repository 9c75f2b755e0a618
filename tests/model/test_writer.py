"""Tests that written robots are read back unchanged, with real robots."""

from dataclasses import fields, is_dataclass

import pytest

from kbot.model import RobotModel, read_robot
from kbot.model.writer import to_urdf
from kbot.text import Element, Origin, Source, parse_xml, read_source

FILES = [
    "ROBOTIS-GIT+turtlebot3_manipulation/turtlebot3_manipulation_description/urdf/turtlebot3_manipulation.urdf.xacro.urdf",
    "PickNikRobotics+ros2_robotiq_gripper/robotiq_description/urdf/robotiq_2f_85_gripper.urdf.xacro.urdf",
    "Ekumen-OS+andino/andino_description/urdf/andino.urdf.xacro.urdf",
    "RethinkRobotics+sawyer_robot/sawyer_description/urdf/sawyer.urdf.xacro.urdf",
]


def without_origins(value: object) -> object:
    """The value as plain data, without origins."""
    if isinstance(value, Element):
        children = [c for c in value.children if isinstance(c, Element) or c.value.strip()]
        return (value.tag, value.attributes, [without_origins(c) for c in children])
    if isinstance(value, Origin):
        return "somewhere"
    if is_dataclass(value):
        return {f.name: without_origins(getattr(value, f.name)) for f in fields(value) if f.name != "origin"}
    if isinstance(value, dict):
        return [(key, without_origins(v)) for key, v in value.items()]
    if isinstance(value, tuple):
        return [without_origins(v) for v in value]
    return (
        value if isinstance(value, str | float | int | None) else str(getattr(value, "value", value)).strip()
    )


def again(robot: RobotModel) -> RobotModel:
    return read_robot(parse_xml(Source("again.urdf", to_urdf(robot)))).require()


@pytest.mark.parametrize("file", FILES)
def test_round_trip_of_real_robots(shared, file):
    robot = read_robot(parse_xml(read_source(shared / "corpus/expected" / file))).require()
    assert without_origins(again(robot)) == without_origins(robot)


def test_round_trip_of_rare_features():
    text = """<robot name='r &amp; "s"'>
    <link name='a'><collision name='c'><geometry><capsule radius='.1' length='.2'/></geometry></collision>
      <visual><geometry><mesh filename='file:///x.dae' scale='1 -1 .5'/></geometry>
      <material name='m'><color rgba='.1 .2 .3 .4'/><texture filename='t.png'/></material></visual></link>
    <link name='b'/>
    <joint name='j' type='revolute'><parent link='a'/><child link='b'/><axis xyz='.6 0 .8'/>
      <limit effort='1' velocity='2'/><dynamics friction='.3'/><mimic joint='j' offset='1e-300'/>
      <safety_controller k_velocity='3' soft_lower_limit='-1'/></joint>
    <gazebo reference='a'><mu1>0.1</mu1></gazebo></robot>"""
    robot = read_robot(parse_xml(Source("r.urdf", text))).require()
    assert without_origins(again(robot)) == without_origins(robot)
    assert to_urdf(again(robot)) == to_urdf(robot)
