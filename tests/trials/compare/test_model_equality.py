"""Which edits of a description leave the robot's behaviour as it is, and which do not."""

import random
from collections import Counter
from pathlib import Path

import pytest

from kbot.model import RobotModel
from kbot.model.load import load_robot
from kbot.trials.compare.model_equality import behaviour, is_same

from .generated_edits import ARGUMENTS, CORPUS, HARMLESS, KBOT, Robot, edit_harmlessly, texts_of, write

URDF = """<?xml version="1.0"?>
<robot name="r">
  <link name="base"><visual><geometry><box size="1 1 0.1"/></geometry></visual>
    <collision><geometry><box size="1 1 0.1"/></geometry></collision>
    <inertial><origin xyz="0.1 0 0"/><mass value="2"/><inertia ixx="1" ixy="0" ixz="0" iyy="1" iyz="0" izz="1"/></inertial></link>
  <link name="wheel"><visual><geometry><cylinder radius="0.1" length="0.05"/></geometry></visual>
    <collision><geometry><cylinder radius="0.1" length="0.05"/></geometry></collision>
    <inertial><mass value="0.2"/><inertia ixx="1" ixy="0" ixz="0" iyy="1" iyz="0" izz="1"/></inertial></link>
  <link name="tyre"><visual><geometry><sphere radius="0.2"/></geometry></visual>
    <collision><geometry><box size="0.1 0.1 0.1"/></geometry></collision></link>
  <link name="frame"><visual><geometry><box size="0.1 0.1 0.1"/></geometry></visual></link>
  <joint name="j" type="revolute"><parent link="base"/><child link="wheel"/><origin xyz="0 0.3 0"/><axis xyz="0 1 0"/>
    <limit lower="-1" upper="1" effort="5" velocity="3"/></joint>
  <joint name="t" type="continuous"><parent link="base"/><child link="tyre"/><axis xyz="0 1 0"/></joint>
  <joint name="f" type="fixed"><parent link="base"/><child link="frame"/></joint>
  <gazebo reference="wheel"><mu1>0.9</mu1><kp>1e6</kp><material>Gazebo/Red</material></gazebo>
  <gazebo><plugin name="drive" filename="libgazebo_ros_diff_drive.so"><wheelSeparation>0.3</wheelSeparation>
    <leftJoint>j</leftJoint><rightJoint>t</rightJoint></plugin>
    <plugin name="states" filename="libgazebo_ros_joint_state_publisher.so"><jointName>j</jointName></plugin></gazebo>
</robot>
"""  # noqa: E501

_TYRE = '"t" type="continuous"><parent link="base"/><child link="tyre"/><axis xyz="0 '
_ROUND = '<geometry><cylinder radius="0.1"'
_BOX = "<visual><geometry><box size="
SAME = {
    "number": ('"0 0.3 0"', '"0.0 3e-1 0"'),
    "rounding": ("<wheelSeparation>0.3<", "<wheelSeparation> 0.30000000000000004 <"),
    "no default": ('<origin xyz="0 0.3 0"/>', '<origin rpy="0 0 0" xyz="0 0.3 0"/>'),
    "no dynamics": ('<child link="tyre"/>', '<child link="tyre"/><dynamics damping="0"/>'),
    "order of parts": (
        '<parent link="base"/><child link="tyre"/>',
        '<child link="tyre"/><parent link="base"/>',
    ),
    "gazebo colour": ("<material>Gazebo/Red</material>", ""),
    "gazebo in two": ("</mu1>", '</mu1></gazebo><gazebo reference="wheel">'),
    "visual of a body": ('<visual><geometry><box size="1 1 0.1"/>', '<visual><geometry><box size="9 9 9"/>'),
    "visual of a wheel": (
        '<visual><geometry><cylinder radius="0.1"',
        '<visual><geometry><cylinder radius="0.5"',
    ),
    "visual of a frame": (
        '"frame"><visual><geometry><box size="0.1',
        '"frame"><visual><geometry><box size="0.9',
    ),
    "material": ('<link name="frame"><visual>', '<link name="frame"><visual><material name="m"/>'),
}
DIFFERENT = {
    "origin": ('"0 0.3 0"', '"0 0.30001 0"'),
    "mass": ('<mass value="0.2"', '<mass value="0.21"'),
    "centre of mass": ('"0.1 0 0"', '"-0.1 0 0"'),
    "collision": (f"<collision>{_ROUND}", f'<collision>{_ROUND.replace("0.1", "0.11")}'),
    "visual of a wheel without a round collision": ('<sphere radius="0.2"', '<sphere radius="0.21"'),
    "axis": (f"{_TYRE}1", f"{_TYRE}-1"),
    "limit": ('velocity="3"', 'velocity="2"'),
    "friction": ("<mu1>0.9<", "<mu1>0.8<"),
    "plugin": ("<wheelSeparation>0.3<", "<wheelSeparation>0.31<"),
    "text": ("<leftJoint>j<", "<leftJoint>jj<"),
    "plugin's file": ("libgazebo_ros_joint_state_publisher.so", "libgazebo_ros_p3d.so"),
    "which friction counts": ("<mu1>0.9</mu1>", "<mu1>0.9</mu1><mu1>0.5</mu1>"),
    "type": ('"t" type="continuous"', '"t" type="fixed"'),
    "damping": ('<child link="tyre"/>', '<child link="tyre"/><dynamics damping="0.1"/>'),
}  # fmt: skip


def same_behaviour(one: RobotModel, other: RobotModel) -> bool:
    return is_same(behaviour(one), behaviour(other))


def is_same_after(tmp_path: Path, old: str, new: str) -> bool:
    changed = URDF.replace(old, new)
    assert changed != URDF
    for name, text in (("a", URDF), ("b", changed)):
        (tmp_path / f"{name}.urdf").write_text(text)
    one, other = (load_robot(tmp_path / f"{name}.urdf").require() for name in ("a", "b"))
    return same_behaviour(one, other)


@pytest.mark.parametrize("kind", SAME)
def test_behaviour_stays(tmp_path: Path, kind: str):
    assert is_same_after(tmp_path, *SAME[kind])


@pytest.mark.parametrize("kind", DIFFERENT)
def test_behaviour_changes(tmp_path: Path, kind: str):
    assert not is_same_after(tmp_path, *DIFFERENT[kind])


def test_two_values_of_one_friction_depend_on_the_element(tmp_path: Path):
    """The first value of an element counts, but the last of several elements."""
    one = "<mu1>0.9</mu1><mu1>0.5</mu1>"
    two = '<mu1>0.9</mu1></gazebo><gazebo reference="wheel"><mu1>0.5</mu1>'
    paths = tmp_path / "a.urdf", tmp_path / "b.urdf"
    for path, text in zip(paths, (one, two), strict=True):
        path.write_text(URDF.replace("<mu1>0.9</mu1>", text))
    assert not same_behaviour(*(load_robot(path).require() for path in paths))


@pytest.mark.parametrize("change", ["", "wheel_radius: 0.051", "wheel_radius: 0.050", "{"])
def test_the_content_of_a_parameter_file_counts_and_not_its_place(tmp_path: Path, change: str):
    robots = []
    for name, text in (("a", "wheel_radius: 0.05"), ("b", change or "wheel_radius: 0.05 # m")):
        (tmp_path / name).mkdir()
        (tmp_path / name / "c.yaml").write_text(f"diff_drive:\n  ros__parameters:\n    {text}\n")
        plugin = f"<parameters>{tmp_path / name / 'c.yaml'}</parameters>"
        (tmp_path / f"{name}.urdf").write_text(URDF.replace("<leftJoint>", f"{plugin}<leftJoint>"))
        robots.append(load_robot(tmp_path / f"{name}.urdf").require())
    assert same_behaviour(*robots) == (change in ("", "wheel_radius: 0.050"))


def test_the_content_of_a_collision_mesh_counts_and_not_its_name(tmp_path: Path):
    robots = []
    for name, content in (("a", b"solid a"), ("b", b"solid a"), ("c", b"solid c")):
        (tmp_path / f"{name}.stl").write_bytes(content)
        mesh = f'<collision><geometry><mesh filename="file://{tmp_path}/{name}.stl"/>'
        text = URDF.replace('<collision><geometry><box size="1 1 0.1"/>', mesh)
        (tmp_path / f"{name}.urdf").write_text(text)
        robots.append(load_robot(tmp_path / f"{name}.urdf").require())
    assert same_behaviour(robots[0], robots[1])
    assert not same_behaviour(robots[0], robots[2])


@pytest.mark.parametrize("robot", [KBOT, *CORPUS], ids=lambda robot: robot.name)
def test_twenty_harmless_edits_of_a_real_robot_are_harmless(
    robot: Robot, tmp_path: Path, request: pytest.FixtureRequest, no_packages: None
):
    shared = None if robot is KBOT else request.getfixturevalue("shared")
    # packages are also searched beside a package, so that each robot needs a folder of its own
    (tmp_path / "a").mkdir()
    (tmp_path / "b").mkdir()
    before = robot.copy(shared, tmp_path / "a" / "robot")
    after = robot.copy(shared, tmp_path / "b" / "robot")
    ARGUMENTS[after.file] = robot.arguments
    original, one = texts_of(after), before.load().require()
    kinds: Counter[str] = Counter()
    for seed in range(20):
        rng, texts = random.Random(seed), dict(original)
        kinds[edit_harmlessly(rng, texts, [*HARMLESS][seed % len(HARMLESS)])] += 1
        assert texts != original
        write(texts)
        assert same_behaviour(one, after.load().require()), f"{seed}: {kinds}"
        write(original)
    assert len(kinds) >= 10
