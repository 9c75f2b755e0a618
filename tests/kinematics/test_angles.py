"""Wrapped angles: above -pi and at most pi, everywhere."""

import math

import numpy as np
import pytest

from kbot.kinematics.angles import wrap, wrap_all
from kbot.kinematics.planar_pose import PlanarPose
from kbot.messages.types import Quaternion, yaw_of

PI = math.pi
WRAPPED = [
    (0.0, 0.0),
    (1.0, 1.0),
    (-1.0, -1.0),
    (PI, PI),
    (-PI, PI),
    (3.0 * PI, PI),
    (-3.0 * PI, PI),
    (math.nextafter(PI, 0.0), math.nextafter(PI, 0.0)),
    (math.nextafter(-PI, 0.0), math.nextafter(-PI, 0.0)),
    (math.nextafter(PI, 4.0), -PI),
    (math.nextafter(-PI, -4.0), PI),
    (1.5 * PI, -0.5 * PI),
    (-1.5 * PI, 0.5 * PI),
    (2.0 * PI, 0.0),
    (20.0 * PI + 0.25, 0.25),
]


@pytest.mark.parametrize(("angle", "expected"), WRAPPED)
def test_angles_are_above_minus_pi_and_at_most_pi(angle: float, expected: float) -> None:
    found = wrap(angle)
    assert found == pytest.approx(expected, abs=1e-13)
    assert -PI < found <= PI
    assert wrap_all(np.array([angle])).tolist() == [found]


def test_an_angle_that_is_wrapped_keeps_all_digits() -> None:
    angles = np.random.default_rng(1).uniform(-PI, PI, 10_000)
    assert [wrap(angle) for angle in angles.tolist()] == angles.tolist() == wrap_all(angles).tolist()


def test_angles_are_those_of_ros() -> None:
    """`normalize_angle` in angles.h of github.com/ros/angles."""
    for angle in (*np.linspace(-30.0, 30.0, 601).tolist(), PI, -PI):
        rest = math.fmod(angle + PI, 2.0 * PI)
        assert wrap(angle) == pytest.approx(rest + PI if rest <= 0.0 else rest - PI, abs=1e-12)


def test_a_yaw_that_is_not_a_number_stays_so() -> None:
    assert math.isnan(wrap(math.nan))
    assert math.isnan(wrap(math.inf))


def test_combined_poses_have_wrapped_yaws() -> None:
    half = PlanarPose(1.0, 0.0, 2.0)
    assert (half @ half).yaw == pytest.approx(4.0 - 2.0 * PI)
    assert PlanarPose(yaw=PI).inverse().yaw == PI
    assert (PlanarPose(yaw=-3.0).inverse() @ PlanarPose(yaw=3.0)).yaw == pytest.approx(6.0 - 2.0 * PI)


@pytest.mark.parametrize("length", [1.0, 2.5])
@pytest.mark.parametrize("yaw", [0.0, 0.4, -2.0, 3.1])
def test_the_yaw_of_a_quaternion_does_not_depend_on_its_length(yaw: float, length: float) -> None:
    turn = Quaternion.about_z(yaw)
    assert turn.yaw == pytest.approx(yaw)
    assert yaw_of(*(length * value for value in (turn.x, turn.y, turn.z, turn.w))) == pytest.approx(yaw)
