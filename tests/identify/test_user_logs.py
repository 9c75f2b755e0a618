"""Tests logs as users record them: with stops, slips, a lifted robot, and drives that show little."""

import dataclasses

import numpy as np
import pytest

from kbot.identify.csv_file import read_csv
from kbot.identify.identification import KINEMATIC, identify
from kbot.identify.log import Motions
from kbot.identify.noise import Noise, covariances
from kbot.identify.nominal import read_nominal
from kbot.identify.observability import observability
from kbot.identify.odometry_model import CURVATURE, Linearization

from .synthetic import DISPLACEMENTS, POSES, Truth, chained, rotation, rows, speeds, write

NOMINAL = read_nominal("kbot", {}, {}, (), None)
TRUTH = Truth()
NOISE = (0.001, 0.002)


@pytest.fixture
def rng():
    return np.random.default_rng(11)


def drive(rng, count=200):
    return rows(TRUTH, speeds(TRUTH, count, rng), rng, slip=0.01, noise=NOISE)


def stop(rng, count, noise):
    return rows(TRUTH, np.zeros((count, 2)), rng, noise=noise)


def identified(path, table, header=DISPLACEMENTS):
    return identify(read_csv(str(write(path / "log.csv", header, table))), NOMINAL)


def values(found):
    return [estimate.value for estimate in found.parameters.values()]


def hidden(found):
    return [name for name in KINEMATIC if name in found.unobservable]


def require_near_the_truth(found, names=KINEMATIC):
    """Each estimate is within its interval, twice as wide: this holds for 99.99 % of all estimates."""
    for name in names:
        estimate = found.parameters[name]
        assert abs(estimate.value - getattr(TRUTH, name)) < estimate.high - estimate.low, name


@pytest.mark.parametrize("noise", [(0.0, 0.0), (1e-4, 2e-4), NOISE])
@pytest.mark.parametrize("count", [60, 600])
def test_a_stop_at_the_start_changes_nothing(tmp_path, rng, noise, count):
    """A stop does not depend on the parameters, so it cannot show them, however long it is."""
    driven = drive(rng)
    found = identified(tmp_path, np.vstack([stop(rng, count, noise), driven]))
    np.testing.assert_allclose(values(found), values(identified(tmp_path, driven)), rtol=1e-9)
    assert found.residual.intervals + found.residual.outliers == len(driven)


@pytest.mark.parametrize("noise", [(0.0, 0.0), (1e-4, 2e-4), NOISE])
@pytest.mark.parametrize("count", [60, 600])
def test_a_pause_is_not_used(tmp_path, rng, noise, count):
    """The displacements before and after it no longer have a pose in common, which changes their weights."""
    driven = drive(rng)
    found = identified(tmp_path, np.insert(driven, [100] * count, stop(rng, count, noise), axis=0))
    require_near_the_truth(found)
    assert found.residual.intervals + found.residual.outliers == len(driven)


def test_encoders_that_change_by_a_digit_in_a_stop(tmp_path, rng):
    standing = stop(rng, 60, (0.0, 0.0))
    standing[:, 1:3] = rng.choice([-1e-3, 0.0, 1e-3], (60, 2))
    found = identified(tmp_path, np.vstack([standing, drive(rng)]))
    require_near_the_truth(found)


def test_a_wheel_that_slips_for_a_second_is_left_out(tmp_path, rng):
    table = drive(rng)
    slipping, absent = table.copy(), table.copy()
    slipping[100:102, 1] *= 1.6
    absent[100:102, 3:] = np.nan
    found, expected = identified(tmp_path, slipping), identified(tmp_path, absent)
    np.testing.assert_allclose(values(found), values(expected), rtol=1e-3)
    assert found.residual.intervals == expected.residual.intervals


def test_a_robot_that_is_lifted_is_left_out(tmp_path, rng):
    """Its wheels turn for 5 s, and the reference does not move."""
    table = drive(rng)
    table[100:110, 3:] = rng.normal(0.0, 1.0, (10, 3)) * (NOISE[0], *NOISE)
    found = identified(tmp_path, table)
    require_near_the_truth(found)
    assert found.residual.outliers >= 9  # one of the ten may have been a small motion


def test_a_robot_that_is_put_elsewhere_is_left_out(tmp_path, rng):
    table = drive(rng)
    table[:, 0], table[:, 3:] = np.cumsum(table[:, 0]), chained(table[:, 3:])
    table[100:, 3:5] = table[100:, 3:5] @ rotation(1.0).T + (1.0, -2.0)
    table[100:, 5] += 1.0
    require_near_the_truth(identified(tmp_path, table, POSES))


def measured(rng, wheel_speeds, encoder_noise, jitter=0.0):
    """A log with a good reference of wheels whose speeds vary by `jitter`, seen by noisy encoders."""
    true = wheel_speeds * (1.0 + jitter * rng.normal(0.0, 1.0, wheel_speeds.shape))
    table = rows(TRUTH, true, rng, noise=(3e-4, 3e-4))
    table[:, 1:3] *= 1.0 + encoder_noise * rng.normal(0.0, 1.0, true.shape)
    return table


STRAIGHT = np.full((300, 2), 10.0) * (1.0, TRUTH.left_wheel_radius / TRUTH.right_wheel_radius)


@pytest.mark.parametrize("jitter", [1e-3, 5e-3])
def test_encoder_noise_of_a_straight_drive_is_no_turn(tmp_path, rng, jitter):
    """Half or more of the differences between the wheels are noise, so that what seems to follow from them,
    the separation, would be twice the true one or more."""
    found = identified(tmp_path, measured(rng, STRAIGHT, 5e-3, jitter))
    assert hidden(found) == ["wheel_separation", "sensor_x", "sensor_y"]
    require_near_the_truth(found, ["left_wheel_radius", "right_wheel_radius", "sensor_yaw"])


def test_a_straight_drive_whose_speeds_are_only_noise_shows_no_turn(tmp_path, rng):
    found = identified(tmp_path, measured(rng, STRAIGHT, 5e-3))
    assert {"wheel_separation", "sensor_x", "sensor_y"} <= set(hidden(found))
    require_near_the_truth(found, [name for name in KINEMATIC if name in found.parameters])


@pytest.mark.parametrize("wheel_speeds", [(8.0, 12.0), (-8.0, 8.0)], ids=["one circle", "rotation"])
@pytest.mark.parametrize("encoder_noise", [0.0, 5e-3])
def test_one_constant_motion_shows_no_size(tmp_path, rng, wheel_speeds, encoder_noise):
    """All displacements are the same three numbers, which cannot give six parameters."""
    found = identified(tmp_path, measured(rng, np.full((300, 2), wheel_speeds), encoder_noise))
    assert hidden(found) == list(KINEMATIC)


def test_the_bias_from_encoder_noise_is_that_of_theory(rng):
    """Straight drives, a sensor on the axle: a turn is (right - left) * radius * curvature. The slope of a
    regression on x with noise is too small by the share of the noise in the variance of x (Fuller, 1.1)."""
    count, radius, separation, angle, slip = 4000, 0.035, 0.17, 5.0, 0.004
    angles = angle * (1.0 + 0.02 * rng.normal(0.0, 1.0, (count, 2)))
    starts = np.arange(count)
    motions = Motions(wheel_angles=angles, start=starts, stop=starts + 1, displacements=np.zeros((count, 3)))
    model = Linearization.at(np.array([radius, radius, 1.0 / separation, 0.0, 0.0, 0.0]), motions)
    noise = Noise(1e-4, 1e-4, 1e-9, 1e-9, slip, 1e-9)
    scales = np.array([radius, radius, 1.0 / separation, separation, separation, 1.0])
    weights = 1.0 / np.sqrt(np.diagonal(covariances(model, noise), axis1=1, axis2=2))
    white = (model.derivatives * scales * weights[:, :, None]).reshape(-1, 6)
    share = 2.0 * slip**2 * np.mean(angles**2) / np.var(angles[:, 1] - angles[:, 0])
    expected = share / (1.0 - share)  # of the estimate, which is 1 - share of the truth
    assert observability(model, noise, white, scales).bias[CURVATURE] == pytest.approx(expected, rel=0.05)


def test_intervals_contain_the_bias_from_encoder_noise(tmp_path):
    """A hundredth of the differences between the wheels is noise: the separation is 1 % too large."""
    hits = []
    for seed in range(10):
        table = measured(np.random.default_rng(seed), STRAIGHT, 1e-3, 1e-2)
        found = identified(tmp_path, table)
        estimate = found.parameters["wheel_separation"]
        hits.append(estimate.low <= dataclasses.asdict(TRUTH)["wheel_separation"] <= estimate.high)
    assert sum(hits) >= 8  # less than 8 of 10 have a probability of 1 % at 95 %
