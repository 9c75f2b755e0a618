"""Reading any description, and finding its drive, never raises an exception."""

import random

import pytest

from kbot.kinematics import DifferentialDrive, FrameTree, NoDrive, find_drive
from kbot.kinematics.bodies import robot_bounds
from kbot.kinematics.robot_info import describe
from kbot.model import read_robot
from kbot.model.load import load_robot
from kbot.model.writer import to_urdf
from kbot.text import Element, Source, parse_xml

VALUES = [
    "",
    "0",
    "-1",
    "nan",
    "1e999",
    "1e300",
    "0 0 0",
    "1 0",
    "fixed",
    "floating",
    "revolute",
    "base_link",
    "x y z",
]


def spoil(root: Element, dice: random.Random) -> None:
    """Remove, repeat, rename or overwrite a few elements or attributes."""
    for _ in range(dice.randint(1, 4)):
        parent = dice.choice([e for e in [root, *root.descendants()] if any(e.elements())])
        child = dice.choice(list(parent.elements()))
        match dice.randint(0, 4):
            case 0:
                parent.children.remove(child)
            case 1:
                parent.children.append(child)
            case 2:
                child.tag = dice.choice([*(e.tag for e in root.descendants()), "nonsense"])
            case 3 if child.attributes:
                child.attributes[dice.choice(list(child.attributes))] = dice.choice(VALUES)
            case 4 if child.attributes:
                del child.attributes[dice.choice(list(child.attributes))]


@pytest.mark.parametrize("seed", range(300))
def test_damaged_descriptions_end_without_an_exception(seed):
    text = load_robot("kbot").expansion.text
    root = parse_xml(Source("kbot.urdf", text))
    spoil(root, random.Random(seed))
    reading = read_robot(root)
    assert all(d.origin is not None for d in reading.diagnostics)
    robot = reading.robot
    if robot is None:
        assert any(d.is_error for d in reading.diagnostics)
        return
    tree = FrameTree(robot)
    assert set(tree.poses()) == set(robot.links)
    assert isinstance(find_drive(robot, tree), DifferentialDrive | NoDrive)
    if not reading.diagnostics:
        describe(robot)
        robot_bounds(tree)
        assert read_robot(parse_xml(Source("again.urdf", to_urdf(robot)))).robot is not None


def test_a_chain_of_3000_joints_is_read():
    n = 3000
    links = "".join(f"<link name='l{i}'/>" for i in range(n))
    joints = "".join(
        f"<joint name='j{i}' type='fixed'><origin xyz='0.001 0 0'/>"
        f"<parent link='l{i}'/><child link='l{i + 1}'/></joint>"
        for i in range(n - 1)
    )
    robot = read_robot(
        parse_xml(Source("chain.urdf", f"<robot name='chain'>{links}{joints}</robot>"))
    ).require()
    assert FrameTree(robot).pose(f"l{n - 1}").translation[0] == pytest.approx(2.999)
    assert isinstance(find_drive(robot), NoDrive)
    wheels = (
        "<link name='w'/><joint name='t' type='continuous'><parent link='l2999'/><child link='w'/></joint>"
    )
    robot = read_robot(
        parse_xml(Source("c.urdf", f"<robot name='c'>{links}{joints}{wheels}</robot>"))
    ).require()
    assert isinstance(find_drive(robot), NoDrive)
