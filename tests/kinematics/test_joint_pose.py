"""`JointPose`, compared with results computed by hand and with `FrameTree`."""

import math

import numpy as np
import pytest

from kbot.kinematics.frames import FrameTree, JointPose
from kbot.kinematics.transform import Transform
from kbot.model.load import load_robot_text

JOINT = """<robot name="r"><link name="a"/><link name="b"/>
<joint name="j" type="{kind}"><parent link="a"/><child link="b"/><axis xyz="{axis}"/>
 <origin xyz="1 2 3" rpy="{rpy}"/><limit lower="-9" upper="9" effort="1" velocity="1"/></joint></robot>"""


def joint_pose(kind: str, axis: str, rpy: str = "0 0 0"):
    robot = load_robot_text(JOINT.format(kind=kind, axis=axis, rpy=rpy), "r.urdf").require()
    return JointPose(robot.joints["j"]), FrameTree(robot)


def test_a_quarter_turn_about_z_after_one_about_x() -> None:
    pose, _ = joint_pose("revolute", "0 0 1", f"{math.pi / 2} 0 0")
    translation, rotation = pose.at(math.pi / 2)
    assert translation == (1.0, 2.0, 3.0)
    # the first turn keeps x, and the second takes it to y of the joint's frame, which is z of the parent's
    turned = Transform.from_quaternion_xyzw(rotation).apply((1.0, 0.0, 0.0))
    assert turned == pytest.approx((0.0, 0.0, 1.0))
    assert rotation == pytest.approx((0.5, -0.5, 0.5, 0.5))


def test_a_prismatic_joint_moves_along_the_rotated_axis() -> None:
    pose, _ = joint_pose("prismatic", "2 0 0", f"0 0 {math.pi / 2}")
    translation, rotation = pose.at(0.25)
    assert translation == pytest.approx((1.0, 2.25, 3.0))
    assert rotation == pytest.approx((0.0, 0.0, math.sqrt(0.5), math.sqrt(0.5)))


@pytest.mark.parametrize("kind", ["revolute", "continuous", "prismatic"])
@pytest.mark.parametrize("axis", ["1 0 0", "0.3 -2 0.5", "0 0 0"])
@pytest.mark.parametrize("position", [0.0, 0.1, -2.0, 4.0, 100.0])
def test_a_joint_pose_agrees_with_the_frame_tree(kind: str, axis: str, position: float) -> None:
    pose, tree = joint_pose(kind, axis, "0.4 -1.1 2.5")
    translation, rotation = pose.at(position)
    expected = tree.pose("b", "a", {"j": position})
    assert translation == pytest.approx(expected.translation)
    found = Transform.from_quaternion_xyzw(rotation, translation)
    assert np.allclose(found.matrix, expected.matrix, atol=1e-12)
    assert rotation[3] >= 0.0
