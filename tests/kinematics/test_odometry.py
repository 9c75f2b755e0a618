"""Planar odometry: arcs are exact for steps of any length."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from kbot.kinematics import PlanarPose, integrate
from kbot.kinematics.planar_pose import arc

small = st.floats(-3, 3)
poses = st.builds(PlanarPose, small, small, small)


def close(a: PlanarPose, b: PlanarPose, tolerance: float = 1e-12) -> bool:
    return math.dist((a.x, a.y, a.yaw), (b.x, b.y, b.yaw)) <= tolerance


def test_straight():
    assert integrate(PlanarPose(), 2.0, 2.0, 0.174) == PlanarPose(2.0, 0.0, 0.0)


def test_on_the_spot():
    quarter = 0.174 / 2 * math.pi / 2
    assert close(integrate(PlanarPose(), -quarter, quarter, 0.174), PlanarPose(0, 0, math.pi / 2))


def test_a_quarter_circle_of_one_metre():
    half = 0.1
    turned = integrate(PlanarPose(), (1 - half) * math.pi / 2, (1 + half) * math.pi / 2, 2 * half)
    assert close(turned, PlanarPose(1.0, 1.0, math.pi / 2))


def test_full_turns_are_wrapped():
    around = integrate(PlanarPose(), -10 * math.pi, 10 * math.pi, 1.0)
    assert close(around, PlanarPose(0, 0, 0), 1e-9)


def test_a_base_behind_the_axle_moves_on_a_circle():
    ahead = PlanarPose(0.02, 0.0, 0.0)
    turned = integrate(PlanarPose(), -math.pi / 4, math.pi / 4, 1.0, ahead)
    assert close(turned, PlanarPose(0.02, -0.02, math.pi / 2))


@given(poses, small, small, st.integers(1, 20), st.floats(0.05, 2), poses)
def test_many_small_steps_equal_one_large_step(start, left, right, steps, separation, axle):
    pose = start
    for _ in range(steps):
        pose = integrate(pose, left / steps, right / steps, separation, axle)
    whole = integrate(start, left, right, separation, axle)
    assert close(pose, whole, 1e-10)


@given(poses, poses, poses)
def test_planar_poses_are_a_group(a, b, c):
    assert close((a @ b) @ c, a @ (b @ c), 1e-12)
    assert close(a @ a.inverse(), PlanarPose(), 1e-12)


@given(poses, poses)
def test_a_point_is_converted_to_the_outer_frame_and_back(outer, point):
    placed = outer @ point
    assert outer.apply(np.array([[point.x, point.y]])) == pytest.approx(
        np.array([[placed.x, placed.y]]), abs=1e-12
    )
    assert outer.local(placed.x, placed.y) == pytest.approx((point.x, point.y), abs=1e-12)
    assert np.stack(outer.local(np.array([placed.x]), np.array([placed.y]))) == pytest.approx(
        np.array([[point.x], [point.y]]), abs=1e-12
    )


@given(st.floats(-2, 2), st.floats(-1e-3, 1e-3))
def test_the_series_for_small_turns_agrees_with_the_quotient(length, turn):
    chord = arc(length, turn)
    assert math.hypot(chord.x, chord.y) == pytest.approx(abs(length), rel=1e-6)
