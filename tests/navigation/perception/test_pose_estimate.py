"""The pose estimate follows the true pose although the wheels slip."""

import math

import numpy as np
import pytest

from kbot.kinematics import PlanarPose, PlanarTwist
from kbot.kinematics.angles import wrap
from kbot.kinematics.planar_pose import arc
from kbot.navigation.perception.pose_estimate import PoseEstimate

STEP = 0.05
ORIGIN = PlanarPose()


def _drive(estimate, commands, slip, gyro=True, bias=0.0, start=ORIGIN, drift=0.0):
    """Drive by (v, w) per step. The wheels measure turns larger by `slip`. Returns the true pose."""
    true, wheels = start, PlanarPose()
    estimate.add_odometry(0.0, wheels, PlanarTwist())
    for number, (v, w) in enumerate(commands, 1):
        time = number * STEP
        true = true @ arc(v * STEP, w * STEP)
        across = PlanarPose(0.0, -drift * v * w * STEP)
        true = true @ across
        wheels = wheels @ arc(v * STEP, slip * w * STEP)
        if gyro:
            for part in (0.5, 1.0):
                estimate.add_rate(time - STEP * (1.0 - part), w + bias)
        estimate.add_odometry(time, wheels, PlanarTwist(v, 0.0, slip * w))
    return true


def _off(estimate, true):
    return math.hypot(estimate.pose.x - true.x, estimate.pose.y - true.y)


SQUARE = ([(0.0, 0.0)] * 10) + ([(1.0, 0.0)] * 40 + [(0.5, 1.0)] * 31) * 4


def test_a_gyroscope_replaces_the_turns_of_slipping_wheels():
    start = PlanarPose(1.0, -2.0, 0.7)
    fused, wheels_only = PoseEstimate(start), PoseEstimate(start)
    true = _drive(fused, SQUARE, 1.2, start=start)
    _drive(wheels_only, SQUARE, 1.2, gyro=False, start=start)
    # 12 m driven; the only error is the trapezoid at each change of the rate
    assert _off(fused, true) < 0.1
    assert _off(wheels_only, true) > 1.0


@pytest.mark.parametrize("gyro", [True, False])
def test_a_heading_to_the_rear_is_nothing_special(gyro):
    """At 0.2 m/s and 1 rad/s for 10 s, the heading passes pi twice. The yaw of odometry is wrapped."""
    estimate = PoseEstimate(PlanarPose())
    true = _drive(estimate, [(0.2, 1.0)] * 200, 1.0, gyro=gyro)
    # a gyroscope's first step is a trapezoid from rest, half as large
    late = STEP / 2.0 if gyro else 0.0
    assert _off(estimate, true) < 1.05 * math.hypot(true.x, true.y) * late + 1e-9
    for step in range(120, 200):  # the estimate remembers 200 poses; 140 steps are 7 rad
        half_way = estimate.at((step + 0.5) * STEP).yaw
        assert wrap(half_way - (step + 0.5) * STEP) == pytest.approx(-late, abs=1e-9)


def test_without_slip_the_wheels_are_enough():
    estimate = PoseEstimate(PlanarPose())
    true = _drive(estimate, SQUARE, 1.0, gyro=False)
    assert _off(estimate, true) < 1e-9
    assert estimate.pose.yaw == pytest.approx(true.yaw)


def test_the_bias_of_the_gyroscope_is_measured_at_rest():
    estimate = PoseEstimate(PlanarPose())
    still = [(0.0, 0.0)] * 10
    true = _drive(estimate, still + [(1.0, 0.0)] * 200, 1.0, bias=0.02)
    # 10 m with a bias of 0.02 rad/s would end 1 m beside
    assert _off(estimate, true) < 0.02


def test_a_drifting_base_is_modelled():
    curve = [(1.5, 1.0)] * 60
    estimate = PoseEstimate(PlanarPose(), drift=0.17)
    true = _drive(estimate, curve, 1.0, gyro=False, drift=0.17)
    assert _off(estimate, true) < 0.03  # 0.77 m of drift, by the heading in the middle of each step
    plain = PoseEstimate(PlanarPose())
    _drive(plain, curve, 1.0, gyro=False)
    assert _off(plain, true) > 0.2


def test_a_base_turns_about_its_centre():
    estimate = PoseEstimate(PlanarPose(), centre=0.03)
    yaw = _drive(estimate, [(0.0, 1.0)] * 30, 1.0, gyro=False).yaw
    # the point 0.03 m ahead stays where it is
    middle = 0.03 - 0.03 * math.cos(yaw), -0.03 * math.sin(yaw)
    assert (estimate.pose.x, estimate.pose.y) == pytest.approx(middle, abs=1e-3)


def test_an_earlier_pose_is_interpolated():
    estimate = PoseEstimate(PlanarPose())
    _drive(estimate, [(1.0, 0.0)] * 20, 1.0, gyro=False)
    assert estimate.at(0.525).x == pytest.approx(0.525)
    assert estimate.at(0.0).x == 0.0
    assert estimate.at(9.0) == estimate.pose


def test_a_jump_of_yaw_over_full_turns_does_not_move_the_estimate():
    estimate = PoseEstimate(PlanarPose())
    true = _drive(estimate, [(0.0, 2.0)] * 200, 1.0)
    assert _off(estimate, true) < 1e-9
    assert np.isclose(estimate.pose.yaw, true.yaw, atol=0.1)


def test_a_silent_gyroscope_is_replaced_by_the_turns_of_the_wheels():
    estimate, wheels = PoseEstimate(ORIGIN), PlanarPose()
    for number in range(40):
        if number < 10:
            estimate.add_rate(number * STEP, 0.0)
        wheels = wheels @ arc(0.0, 0.05)
        estimate.add_odometry(number * STEP, wheels, PlanarTwist(0.0, 0.0, 1.0))
    # 0.15 s after the last measurement, the wheels take over
    assert estimate.pose.yaw == pytest.approx(0.05 * 27, abs=0.051)


def test_scans_correct_the_pose_once_they_contradict_the_wheels():
    estimate, wheels = PoseEstimate(ORIGIN), PlanarPose()
    estimate.add_odometry(0.0, wheels, PlanarTwist())
    for number in range(1, 41):
        time = number * STEP
        wheels = PlanarPose(0.055 * number)
        estimate.add_odometry(time, wheels, PlanarTwist(1.1))
        assert estimate.at(time) == estimate.pose
        true = PlanarPose(0.05 * number)
        estimate.add_match(time, true)
        is_late = 0.005 * number > 0.03 + 0.03 * 0.055 * number
        assert estimate.is_contradicted == is_late
        assert estimate.pose.x == pytest.approx(true.x if is_late else wheels.x)
        assert estimate.by_scans.x == pytest.approx(true.x)
