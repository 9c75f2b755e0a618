"""Mass, centre of mass and bounds, compared with values computed by hand."""

import math

import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st

from kbot.kinematics import FrameTree, Transform
from kbot.kinematics.bodies import (
    MassProperties,
    center_of_mass,
    possible_moments,
    principal_axes,
    robot_bounds,
    total_mass,
)
from kbot.kinematics.robot_info import describe, describe_as_text
from kbot.model import RobotModel, read_robot
from kbot.text import Source, parse_xml

INERTIA = "<inertia ixx='1' ixy='0' ixz='0' iyy='1' iyz='0' izz='1'/>"
TEXT = f"""<robot name='two'>
<link name='base'><inertial><mass value='3'/>{INERTIA}</inertial>
  <collision><geometry><box size='2 1 1'/></geometry></collision></link>
<link name='arm'><inertial><origin xyz='1 0 0'/><mass value='1'/>{INERTIA}</inertial>
  <visual><origin xyz='1 0 0' rpy='0 1.5707963267948966 0'/>
    <geometry><cylinder radius='0.1' length='2'/></geometry></visual></link>
<joint name='swing' type='revolute'><parent link='base'/><child link='arm'/><origin xyz='0 0 2'/>
  <axis xyz='0 0 1'/><limit lower='-2' upper='2' effort='1' velocity='1'/></joint>
</robot>"""


@pytest.fixture(scope="module")
def robot() -> RobotModel:
    return read_robot(parse_xml(Source("two.urdf", TEXT))).require()


def test_mass_and_center(robot):
    tree = FrameTree(robot)
    assert total_mass(robot) == 4.0
    assert center_of_mass(tree) == pytest.approx([0.25, 0, 0.5])
    quarter = {"swing": 1.5707963267948966}
    assert center_of_mass(tree, joints=quarter) == pytest.approx([0, 0.25, 0.5])
    assert center_of_mass(tree, "arm", quarter) == pytest.approx([0.25, 0, -1.5])


def test_bounds(robot):
    low, high = robot_bounds(FrameTree(robot))
    assert low == pytest.approx([-1, -0.5, -0.5])
    assert high == pytest.approx([2, 0.5, 2.1])
    low, high = robot_bounds(FrameTree(robot), "arm", {"swing": 1.5707963267948966})
    assert low == pytest.approx([-0.5, -1.0, -2.5])
    assert high == pytest.approx([2, 1.0, 0.1])


def test_a_robot_without_shapes_has_no_bounds_and_no_mass():
    robot = read_robot(parse_xml(Source("", "<robot name='r'><link name='a'/></robot>"))).require()
    tree = FrameTree(robot)
    assert robot_bounds(tree) is None
    assert center_of_mass(tree) is None
    assert total_mass(robot) == 0.0


def test_two_points_are_a_dumbbell():
    points = [
        MassProperties(m, np.array((x, 0.0, 0.0)), np.zeros((3, 3))) for m, x in ((1.0, 0.0), (3.0, 2.0))
    ]
    dumbbell = MassProperties.combined(points)
    assert dumbbell.mass == 4.0
    assert dumbbell.center == pytest.approx([1.5, 0.0, 0.0])
    assert dumbbell.tensor == pytest.approx(np.diag((0.0, 3.0, 3.0)))  # 1 * 1.5^2 + 3 * 0.5^2
    upright = dumbbell.in_frame(Transform.from_xyz_rpy((0.0, 0.0, 1.0), (0.0, -math.pi / 2, 0.0)))
    assert upright.center == pytest.approx([0.0, 0.0, 2.5])
    assert upright.tensor == pytest.approx(np.diag((3.0, 3.0, 0.0)))


def test_principal_axes_are_a_rotation():
    turn = Transform.from_xyz_rpy((0.0, 0.0, 0.0), (0.3, -1.0, 2.0)).rotation
    tensor = turn @ np.diag((3.0, 1.0, 2.0)) @ turn.T
    moments, rotation = principal_axes(tensor)
    assert moments == pytest.approx([1.0, 2.0, 3.0])
    assert np.linalg.det(rotation) == pytest.approx(1.0)
    assert rotation @ np.diag(moments) @ rotation.T == pytest.approx(tensor)


def test_a_robot_is_described_as_data_and_as_text(robot):
    data = describe(robot)
    assert (data["name"], data["root"], data["mass"]) == ("two", "base", 4.0)
    assert data["drive"] is None
    assert data["no_drive"] == "the robot has no continuous joint for a wheel: 'swing' is revolute"
    assert data["bounds"]["upper"] == pytest.approx([2, 0.5, 2.1])
    assert data["joints"][0]["child"] == "arm"
    assert data["links"][1]["visuals"] == [{"type": "cylinder", "radius": 0.1, "length": 2.0}]
    text = describe_as_text(robot)
    assert "two: 2 links, 1 joint (1 movable), 4 kg" in text
    assert "└─ arm  revolute swing  1 kg  two.urdf:4" in text
    assert "no differential drive: the robot has no continuous joint" in text


MOMENTS = st.tuples(*[st.floats(-1e3, 1e3)] * 3)


@given(MOMENTS)
def test_repaired_moments_are_those_of_a_body(moments):
    """Each moment is above 0 and at most the sum of the others."""
    possible = possible_moments(moments)
    assume(possible is not None)
    assert min(possible) > 0.0
    assert 2 * max(possible) <= sum(possible)


@given(st.tuples(*[st.floats(1e-3, 10.0)] * 3))
def test_moments_of_a_box_are_not_changed(size):
    a, b, c = (edge**2 for edge in size)
    moments = ((b + c) / 12, (a + c) / 12, (a + b) / 12)
    assert possible_moments(moments) == pytest.approx(moments, rel=1e-9)


@given(MOMENTS, MOMENTS)
def test_no_other_body_is_nearer_than_the_repaired_one(moments, other):
    """Distances are those of the second moments of mass. The thickness moves the result by 1e-4 of them."""
    possible = possible_moments(moments)
    assume(possible is not None)
    given_second, found, others = (sum(m) / 2 - np.array(m) for m in (moments, possible, other))
    distance = np.linalg.norm(found - given_second)
    slack = 2e-4 * max(found)
    assert distance <= np.linalg.norm(np.maximum(others, 0.0) - given_second) + slack


def test_no_body_is_near_moments_that_are_not_above_0():
    assert possible_moments((-2.0, -1.0, 0.0)) is None
