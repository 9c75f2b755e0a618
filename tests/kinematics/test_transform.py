"""Transforms form a group, and rotations agree with their definitions."""

import math
import pickle

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from kbot.kinematics import Transform
from kbot.kinematics.transform import quaternion_xyzw_from_rotation, rotations_about

angles = st.floats(-math.pi, math.pi)
lengths = st.floats(-100, 100)
transforms = st.builds(Transform.from_xyz_rpy, st.tuples(*[lengths] * 3), st.tuples(*[angles] * 3))
points = st.tuples(*[lengths] * 3)


@given(transforms, transforms, transforms)
def test_composition_is_associative(a, b, c):
    assert ((a @ b) @ c).is_close(a @ (b @ c), 1e-9)


@given(transforms)
def test_identity_and_inverse(a):
    one = Transform.identity()
    assert (a @ one).is_close(a, 0.0)
    assert (one @ a).is_close(a, 0.0)
    assert (a @ a.inverse()).is_close(one, 1e-12)
    assert (a.inverse() @ a).is_close(one, 1e-12)
    assert a.inverse().inverse().is_close(a, 1e-12)


@given(transforms, transforms, points)
def test_a_composed_transform_applies_both_transforms(a, b, p):
    assert (a @ b).apply(p) == pytest.approx(a.apply(b.apply(p)), abs=1e-9)


@given(transforms, points, points)
def test_transforms_keep_distances_and_handedness(a, p, q):
    assert math.dist(a.apply(p), a.apply(q)) == pytest.approx(math.dist(p, q), abs=1e-9)
    assert np.linalg.det(a.rotation) == pytest.approx(1.0)


@given(transforms)
def test_rpy_round_trip(a):
    assert Transform.from_xyz_rpy(a.translation, a.rpy).is_close(a, 1e-7)


@given(st.floats(-3.14, 3.14), st.floats(-1.5, 1.5), st.floats(-3.14, 3.14))
def test_rpy_is_returned_unchanged_away_from_the_poles(roll, pitch, yaw):
    assert Transform.from_xyz_rpy((0, 0, 0), (roll, pitch, yaw)).rpy == pytest.approx(
        (roll, pitch, yaw), abs=1e-9
    )


@given(angles, st.sampled_from([math.pi / 2, -math.pi / 2]), angles)
def test_rpy_at_the_poles_is_the_same_rotation(roll, pitch, yaw):
    a = Transform.from_xyz_rpy((0, 0, 0), (roll, pitch, yaw))
    assert Transform.from_xyz_rpy((0, 0, 0), a.rpy).is_close(a, 1e-9)


@given(transforms)
def test_quaternion_round_trip(a):
    x, y, z, w = a.quaternion_xyzw
    assert math.hypot(x, y, z, w) == pytest.approx(1.0)
    assert w >= 0.0
    assert Transform.from_quaternion_xyzw((x, y, z, w), a.translation).is_close(a, 1e-12)


@pytest.mark.parametrize("axis", range(3))
def test_half_turns_have_exact_quaternions(axis):
    rotation = -np.eye(3)
    rotation[axis, axis] = 1.0
    expected = [0.0, 0.0, 0.0, 0.0]
    expected[axis] = 1.0
    assert quaternion_xyzw_from_rotation(rotation) == tuple(expected)


def test_rpy_turns_about_fixed_axes_in_order():
    rpy = (0.1, 0.2, 0.3)
    about = [rotations_about(axis, angle) for axis, angle in zip(np.eye(3), rpy, strict=True)]
    expected = about[2] @ about[1] @ about[0]
    assert Transform.from_xyz_rpy((0, 0, 0), rpy).rotation == pytest.approx(expected, abs=1e-15)


def test_a_quarter_turn_about_z_takes_x_to_y():
    a = Transform.from_xyz_rpy((1, 2, 3), (0, 0, math.pi / 2))
    assert a.apply((1, 0, 0)) == pytest.approx([1, 3, 3])
    assert a.apply([(1, 0, 0), (0, 1, 0)]) == pytest.approx(np.array([[1, 3, 3], [0, 2, 3]]))
    assert a.yaw == pytest.approx(math.pi / 2)
    assert a.quaternion_xyzw == pytest.approx((0, 0, math.sqrt(0.5), math.sqrt(0.5)))


@pytest.mark.parametrize(
    "matrix",
    [np.eye(3), np.diag([2.0, 1, 1, 1]), np.diag([-1.0, 1, 1, 1]), np.full((4, 4), np.nan), np.ones((4, 4))],
)
def test_a_matrix_that_is_not_rigid_is_refused(matrix):
    with pytest.raises(ValueError, match=r"\(4, 4\)|finite|rigid"):
        Transform(matrix)


def test_a_transform_cannot_be_changed():
    a = Transform.identity()
    with pytest.raises(ValueError, match="read-only"):
        a.matrix[0, 0] = 2.0
    with pytest.raises(AttributeError):
        a.matrix = np.eye(4)
    with pytest.raises(AttributeError):
        a._matrix = np.eye(4)


def test_equality_hash_and_pickle():
    a = Transform.from_xyz_rpy((1, 2, 3), (0.1, 0.2, 0.3))
    assert pickle.loads(pickle.dumps(a)) == a
    assert hash(Transform(a.matrix)) == hash(a)
    assert a != Transform.identity()
    mirrored = Transform.from_xyz_rpy((-0.0, 0, 0), (0, 0, 0))
    assert mirrored == Transform.identity()
    assert hash(mirrored) == hash(Transform.identity())


def test_zero_quaternion_is_refused():
    with pytest.raises(ValueError, match="zero"):
        Transform.from_quaternion_xyzw((0, 0, 0, 0))


@pytest.mark.parametrize("length", [1e-320, 1e-200, 1e-150, 1.0, 1e160, 1e308])
def test_a_quaternion_of_any_length_is_accepted(length: float) -> None:
    """A quarter turn about z, from quaternions of several lengths."""
    turned = Transform.from_quaternion_xyzw((0.0, 0.0, length, length)).apply((1.0, 0.0, 0.0))
    assert turned.tolist() == pytest.approx([0.0, 1.0, 0.0], abs=1e-12)


@pytest.mark.parametrize("value", [math.nan, math.inf])
def test_numbers_that_are_not_finite_are_refused(value):
    with pytest.raises(ValueError, match="not finite"):
        Transform.from_xyz_rpy((0, 0, value), (0, 0, 0))
    with pytest.raises(ValueError, match="not finite"):
        Transform.from_xyz_rpy((0, 0, 0), (0, value, 0))
    with pytest.raises(ValueError, match="not finite"):
        Transform.from_quaternion_xyzw((0, 0, 0, 1), (value, 0, 0))
