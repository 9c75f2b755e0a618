"""Forward kinematics, compared with ROS, with itself, and with results computed by hand."""

import json
import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from kbot.kinematics import FrameTree, Transform
from kbot.kinematics.frames import unit_axis
from kbot.model import RobotModel, read_robot
from kbot.text import KbotError, Source, parse_xml, read_source

CHAIN = """<robot name='chain'>
<link name='base'/><link name='a'/><link name='b'/><link name='c'/><link name='d'/><link name='e'/>
<joint name='turn' type='continuous'><parent link='base'/><child link='a'/>
  <origin xyz='1 0 0.5' rpy='0.1 0.2 0.3'/><axis xyz='0 0 2'/></joint>
<joint name='slide' type='prismatic'><parent link='a'/><child link='b'/>
  <origin rpy='0 1 0'/><axis xyz='1 1 0'/><limit effort='1' velocity='1'/></joint>
<joint name='hold' type='fixed'><parent link='b'/><child link='c'/><origin xyz='0 0 1' rpy='1 0 0'/></joint>
<joint name='mirror' type='revolute'><parent link='c'/><child link='d'/><axis xyz='0 1 0'/>
  <limit effort='1' velocity='1'/><mimic joint='turn' multiplier='-2' offset='0.5'/></joint>
<joint name='again' type='revolute'><parent link='base'/><child link='e'/><axis xyz='0 1 0'/>
  <limit effort='1' velocity='1'/><mimic joint='mirror' multiplier='3' offset='1'/></joint>
</robot>"""


def robot(text: str) -> RobotModel:
    return read_robot(parse_xml(Source("robot.urdf", text))).require()


@pytest.fixture(scope="module")
def tree() -> FrameTree:
    return FrameTree(robot(CHAIN))


def test_frames_agree_with_ros(shared):
    got = FrameTree(read_robot(parse_xml(read_source(shared / "chapter/corrected/kbot.urdf"))).require())
    for case in json.loads((shared / "chapter/ros_reference/tf_transforms.json").read_text()):
        joints = case["joint_positions"]
        given_frames = [*case["tf"], *case["tf_static"], *case["composed_from_base_footprint"].values()]
        assert len(given_frames) == 8
        for frame in given_frames:
            expected = Transform.from_quaternion_xyzw(frame["rotation_xyzw"], frame["translation"])
            assert got.pose(frame["child"], frame["parent"], joints).is_close(expected, 1e-12)


def test_a_chain_by_hand(tree):
    q, s = 0.7, 0.25
    by_hand = (
        Transform.from_xyz_rpy((1, 0, 0.5), (0.1, 0.2, 0.3))
        @ Transform.from_xyz_rpy((0, 0, 0), (0, 0, q))
        @ Transform.from_xyz_rpy((0, 0, 0), (0, 1, 0))
        @ Transform.from_xyz_rpy((s / math.sqrt(2), s / math.sqrt(2), 0), (0, 0, 0))
        @ Transform.from_xyz_rpy((0, 0, 1), (1, 0, 0))
        @ Transform.from_xyz_rpy((0, 0, 0), (0, -2 * q + 0.5, 0))
    )
    assert tree.pose("d", joints={"turn": q, "slide": s}).is_close(by_hand, 1e-14)
    assert tree.poses({"turn": q, "slide": s})["d"].is_close(by_hand, 1e-14)


def test_mimic_of_a_mimic(tree):
    pose = tree.pose("e", joints={"turn": 0.2})
    assert pose.is_close(Transform.from_xyz_rpy((0, 0, 0), (0, 3 * (-2 * 0.2 + 0.5) + 1, 0)), 1e-14)


def test_a_mimic_joint_with_a_given_position_keeps_it(tree):
    pose = tree.pose("e", joints={"turn": 0.2, "again": 0.1})
    assert pose.is_close(Transform.from_xyz_rpy((0, 0, 0), (0, 0.1, 0)), 1e-14)


positions = st.fixed_dictionaries({"turn": st.floats(-10, 10), "slide": st.floats(-1, 1)})


@given(positions, st.sampled_from("abcde"), st.sampled_from("abcde"))
def test_poses_in_other_frames_agree_with_poses_in_the_root(q, first, second):
    tree = FrameTree(robot(CHAIN))
    poses = tree.poses(q)
    expected = poses[second].inverse() @ poses[first]
    assert tree.pose(first, second, q).is_close(expected, 1e-13)
    assert (tree.pose(first, second, q) @ tree.pose(second, first, q)).is_close(Transform.identity(), 1e-12)


@settings(max_examples=30)
@given(st.lists(st.tuples(st.floats(-10, 10), st.floats(-1, 1)), min_size=0, max_size=5))
def test_a_batch_agrees_with_single_poses(rows):
    tree = FrameTree(robot(CHAIN))
    batch = tree.batch(["turn", "slide"], np.array(rows).reshape(-1, 2))
    assert all(matrices.shape == (len(rows), 4, 4) for matrices in batch.values())
    for i, (turn, slide) in enumerate(rows):
        for link, pose in tree.poses({"turn": turn, "slide": slide}).items():
            assert np.abs(batch[link][i] - pose.matrix).max() < 1e-14


def test_a_batch_of_some_links(tree):
    some = tree.batch(["turn"], np.zeros((4, 1)), links=["b"])
    assert list(some) == ["b"]
    assert some["b"][3] == pytest.approx(tree.pose("b").matrix)


@pytest.mark.parametrize("kind", ["floating", "planar"])
def test_planar_and_floating_joints_are_at_zero(kind):
    got = robot(
        f"<robot name='r'><link name='a'/><link name='b'/><joint name='j' type='{kind}'>"
        "<origin xyz='1 2 3'/><parent link='a'/><child link='b'/></joint></robot>"
    )
    assert FrameTree(got).pose("b").translation == pytest.approx([1, 2, 3])
    with pytest.raises(KbotError, match=f"'j' is {kind}"):
        FrameTree(got).pose("b", joints={"j": 1.0})


@pytest.mark.parametrize("mimics", [("k", "j"), ("j", "k"), ("none", "j")])
def test_mimic_joints_without_a_usable_leader_move_freely(mimics):
    got = robot(
        "<robot name='r'><link name='a'/><link name='b'/><link name='c'/>"
        "<joint name='j' type='continuous'><parent link='a'/><child link='b'/>"
        f"<axis xyz='0 0 1'/><mimic joint='{mimics[0]}'/></joint>"
        "<joint name='k' type='continuous'><parent link='b'/><child link='c'/>"
        f"<axis xyz='0 0 1'/><mimic joint='{mimics[1]}'/></joint></robot>"
    )
    assert FrameTree(got).pose("b", joints={"j": 0.5}).yaw == pytest.approx(0.5)


@pytest.mark.parametrize("axis", ["0 3e200 4e200", "0 3e-200 4e-200"])
def test_an_axis_of_any_length_is_a_direction(axis):
    got = robot(
        "<robot name='r'><link name='a'/><link name='b'/><joint name='j' type='continuous'>"
        f"<parent link='a'/><child link='b'/><axis xyz='{axis}'/></joint></robot>"
    )
    assert unit_axis(got.joints["j"]) == pytest.approx([0.0, 0.6, 0.8])


def test_a_zero_axis_turns_nothing():
    got = robot(
        "<robot name='r'><link name='a'/><link name='b'/><joint name='j' type='continuous'>"
        "<parent link='a'/><child link='b'/><axis xyz='0 0 0'/></joint></robot>"
    )
    assert FrameTree(got).pose("b", joints={"j": 1.0}).is_close(Transform.identity(), 0.0)


@pytest.mark.parametrize(
    ("call", "message"),
    [
        (lambda t: t.pose("bse"), "no link 'bse': did you mean 'base'"),
        (lambda t: t.pose("a", "bse"), "no link 'bse'"),
        (lambda t: t.pose("a", joints={"trun": 1}), "no joint 'trun': did you mean 'turn'"),
        (lambda t: t.pose("a", joints={"hold": 1}), "'hold' is fixed"),
        (lambda t: t.poses({"turn": math.nan}), "'turn' is not finite"),
        (lambda t: t.batch(["turn"], [[1.0], [math.inf]]), "'turn' is not finite"),
        (lambda t: t.poses({"turn": "fast"}), "'turn' is not a number: 'fast'"),
        (lambda t: t.batch(["turn", "slide"], [[1.0, 2.0], [3.0]]), "not a table of numbers"),
        (lambda t: t.batch(["turn"], [[1.0, 2.0]]), r"shape \(n, 1\)"),
        (lambda t: t.batch(["turn"], [[1.0]], links=["x"]), "no link 'x'"),
    ],
)
def test_bad_input_is_one_clear_error(tree, call, message):
    with pytest.raises(KbotError, match=message):
        call(tree)
