"""Tests how the wheels follow commands, and the scale of the gyro, with synthetic logs of known values."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from kbot.identify.csv_file import read_csv
from kbot.identify.dynamic import DELAY, ENCODER, GYRO, TIME_CONSTANT, Response, response
from kbot.identify.identification import identify
from kbot.identify.nominal import read_nominal

from .synthetic import DISPLACEMENTS, Truth, rows, speeds, write

NOMINAL = read_nominal("kbot", {}, {}, (), None)
RADIUS, SEPARATION = 0.035, 0.174  # with which KBot's controller computes
STEP = 0.05
HEADER = DISPLACEMENTS + ",cmd_v,cmd_w"


def followed(commanded, scale, delay, constant):
    """The mean wheel speeds in each interval of `STEP` s, by steps of 1 ms. The delay is in whole ms."""
    fine = np.repeat(commanded, round(STEP * 1000), axis=0)
    shift = round(delay * 1000)
    delayed = scale * np.vstack([np.repeat(fine[:1], shift, axis=0), fine])[: len(fine)]
    state, decay = delayed[0].copy(), math.exp(-0.001 / constant)
    means = np.empty_like(delayed)
    for index, wanted in enumerate(delayed):
        # the exact mean of an exponential over the step
        means[index] = wanted + (state - wanted) * constant / 0.001 * (1.0 - decay)
        state = wanted + (state - wanted) * decay
    return means.reshape(len(commanded), -1, 2).mean(axis=1)


def commands(rng, count=200):
    """Twists that change about once a second."""
    twists = np.column_stack([rng.uniform(-0.3, 0.5, count), rng.uniform(-1.0, 1.0, count)])
    changes = np.maximum.accumulate(np.where(rng.random(count) < 0.05, np.arange(count), 0))
    return twists[changes]


def log(path, twists, wheels):
    half = twists[:, 1] * SEPARATION / 2.0
    table = [np.full(len(twists), STEP), *wheels.T, 0.0 * half + 0.01, 0.0 * half, 0.0 * half, *twists.T]
    return read_csv(str(write(path / "log.csv", HEADER, np.column_stack(table))))


def wheel_commands(twists):
    half = twists[:, 1] * SEPARATION / 2.0
    return np.column_stack([twists[:, 0] - half, twists[:, 0] + half]) / RADIUS


@settings(max_examples=6)
@given(
    scale=st.floats(0.8, 1.2),
    delay=st.integers(0, 400),
    constant=st.floats(0.02, 0.5),
    seed=st.integers(0, 100),
)
def test_a_log_without_noise_gives_the_response_back(tmp_path_factory, scale, delay, constant, seed):
    twists = commands(np.random.default_rng(seed))
    wheels = followed(wheel_commands(twists), scale, delay / 1000, constant)
    found = response(log(tmp_path_factory.mktemp("log"), twists, wheels), NOMINAL).observable
    assert found[ENCODER].value == pytest.approx(scale, abs=1e-3)
    assert found[DELAY].value == pytest.approx(delay / 1000, abs=1e-3)
    assert found[TIME_CONSTANT].value == pytest.approx(constant, abs=1e-3)


def test_the_intervals_contain_the_truth_in_95_of_100_logs(tmp_path):
    hits = []
    for seed in range(20):
        rng = np.random.default_rng(seed)
        truth = (rng.uniform(0.9, 1.1), rng.integers(0, 300) / 1000, rng.uniform(0.05, 0.4))
        twists = commands(rng)
        wheels = followed(wheel_commands(twists), *truth) + rng.normal(0.0, 0.1, twists.shape)
        found = response(log(tmp_path, twists, wheels), NOMINAL).observable
        hits += [
            found[name].low <= value <= found[name].high
            for name, value in zip((ENCODER, DELAY, TIME_CONSTANT), truth, strict=True)
        ]
    assert 0.95 - 3 * np.sqrt(0.95 * 0.05 / 60) < np.mean(hits)


def test_a_constant_command_shows_only_the_scale(tmp_path):
    twists = np.full((100, 2), (0.3, 0.5))
    wheels = 0.9 * wheel_commands(twists) + np.random.default_rng(1).normal(0.0, 0.01, (100, 2))
    found = response(log(tmp_path, twists, wheels), NOMINAL).observable
    assert list(found) == [ENCODER]
    assert found[ENCODER].value == pytest.approx(0.9, abs=1e-3)


def test_an_empty_command_cell_is_the_last_command(tmp_path):
    twists = commands(np.random.default_rng(4))
    wheels = followed(wheel_commands(twists), 0.9, 0.1, 0.2)
    sparse = twists.copy()
    is_repeated = np.concatenate([[False], (np.diff(twists, axis=0) == 0.0).all(axis=1)])
    sparse[is_repeated] = np.nan
    found, expected = (response(log(tmp_path, each, wheels), NOMINAL).observable for each in (sparse, twists))
    assert found[ENCODER].value == pytest.approx(0.9, abs=1e-3)
    assert found == expected


def test_without_commands_and_gyro_nothing_is_guessed(tmp_path):
    rng = np.random.default_rng(1)
    table = rows(Truth(), speeds(Truth(), 100, rng), rng, noise=(0.001, 0.001))
    found = identify(read_csv(str(write(tmp_path / "log.csv", DISPLACEMENTS, table))), NOMINAL)
    assert list(found.unobservable) == [ENCODER, GYRO, DELAY, TIME_CONSTANT]


def test_the_scale_of_the_gyro_is_not_biased_by_noise(tmp_path):
    # The noise of the reference is as large as a fifth of a turn: a regression on it would be 4 % too small.
    hits, values = 0, []
    for seed in range(20):
        rng = np.random.default_rng(seed)
        truth = Truth()
        table = rows(truth, speeds(truth, 200, rng), rng, slip=0.01, noise=(0.002, 0.06))
        clean = rows(truth, table[:, 1:3], rng)[:, 5]
        gyro = 1.03 * clean / 0.5 + 0.01 + rng.normal(0.0, 0.01, 200)
        header = DISPLACEMENTS + ",imu_wz"
        found = identify(
            read_csv(str(write(tmp_path / "log.csv", header, np.column_stack([table, gyro])))), NOMINAL
        )
        estimate = found.parameters[GYRO]
        hits += estimate.low <= 1.03 <= estimate.high
        values.append(estimate.value)
    assert np.mean(values) == pytest.approx(1.03, abs=0.005)
    assert hits / 20 > 0.95 - 3 * np.sqrt(0.95 * 0.05 / 20)


def test_commands_that_do_not_move_the_wheels_show_nothing(tmp_path):
    rng = np.random.default_rng(3)
    twists = commands(rng)
    wheels = followed(wheel_commands(commands(rng)), 1.0, 0.1, 0.2)
    assert response(log(tmp_path, twists, wheels), NOMINAL) == Response({})


def test_limits_of_acceleration_do_not_change_the_scale(tmp_path):
    """Each wheel speed changes by at most 20 rad/s^2: a ramp, which the exponential of the model is not."""
    for seed in range(10):
        rng = np.random.default_rng(seed)
        twists = np.repeat(commands(rng), 3, axis=0)
        commanded = 0.95 * wheel_commands(twists)
        wheels = np.empty_like(commanded)
        speed = commanded[0]
        for index, wanted in enumerate(commanded):
            before = speed
            speed = speed + np.clip(wanted - speed, -20.0 * STEP, 20.0 * STEP)
            wheels[index] = (before + speed) / 2.0
        found = response(log(tmp_path, twists, wheels), NOMINAL).observable[ENCODER]
        assert found.low <= 0.95 <= found.high
        assert found.value == pytest.approx(0.95, abs=2e-3)


def test_the_error_of_the_response_is_that_of_the_noise(tmp_path):
    rng = np.random.default_rng(5)
    twists = commands(rng, 400)
    wheels = followed(wheel_commands(twists), 0.9, 0.1, 0.2) + rng.normal(0.0, 0.1, twists.shape)
    assert response(log(tmp_path, twists, wheels), NOMINAL).wheel_speed == pytest.approx(0.1, rel=0.1)
