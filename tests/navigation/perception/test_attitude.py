"""An accelerometer shows whether a robot has fallen over."""

import math

import numpy as np
import pytest

from kbot.navigation.perception.attitude import Attitude

GRAVITY = 9.81


def _after(force, seconds, mounted=None):
    attitude = Attitude(np.eye(3) if mounted is None else mounted)
    attitude.add(0.0, tuple((np.eye(3) if mounted is None else mounted).T @ (0.0, 0.0, GRAVITY)))
    for number in range(1, round(seconds * 100) + 1):
        attitude.add(number / 100, force)
    return attitude.describe_fall()


def _tilted(degrees):
    return 0.0, GRAVITY * math.sin(math.radians(degrees)), GRAVITY * math.cos(math.radians(degrees))


@pytest.mark.parametrize("degrees", [0.0, 30.0, 55.0])
def test_a_robot_on_a_ramp_has_not_fallen(degrees):
    assert _after(_tilted(degrees), 2.0) == ""


@pytest.mark.parametrize(("degrees", "where"), [(90.0, "side"), (180.0, "back")])
def test_a_robot_that_lies_is_reported(degrees, where):
    assert _after(_tilted(degrees), 3.0) == (
        f"the robot lies on its {where}: its IMU measures a tilt of {round(degrees)}°"
    )


def test_a_shock_is_not_a_fall():
    assert _after((40.0, 0.0, 0.0), 0.02) == ""


def test_the_mounting_of_the_imu_counts():
    upside_down = np.diag([1.0, -1.0, -1.0])
    assert _after((0.0, 0.0, -GRAVITY), 2.0, upside_down) == ""


def test_before_a_measurement_nothing_is_reported():
    assert Attitude(np.eye(3)).describe_fall() == ""
