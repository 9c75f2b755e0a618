"""Tests identification with synthetic logs of known robots: values, intervals, outliers, observability."""

import dataclasses
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from kbot.identify.csv_file import read_csv
from kbot.identify.identification import KINEMATIC, identify
from kbot.identify.intervals import half_widths
from kbot.identify.nominal import read_nominal
from kbot.text import KbotError

from .synthetic import DISPLACEMENTS, POSES, Truth, chained, rows, speeds, write

NOMINAL = read_nominal("kbot", {}, {}, (), None)


@pytest.fixture
def rng():
    return np.random.default_rng(7)


def identified(path: Path):
    return identify(read_csv(str(path)), NOMINAL)


def hidden(found):
    """The kinematic parameters that the log does not show."""
    return [name for name in KINEMATIC if name in found.unobservable]


def lengths(low, high):
    return st.floats(low, high, allow_nan=False)


@settings(max_examples=25)
@given(
    truth=st.builds(
        Truth,
        left_wheel_radius=lengths(0.02, 0.1),
        right_wheel_radius=lengths(0.02, 0.1),
        wheel_separation=lengths(0.1, 0.5),
        sensor_x=lengths(-0.3, 0.3),
        sensor_y=lengths(-0.2, 0.2),
        sensor_yaw=lengths(-3.1, 3.1),
    ),
    seed=st.integers(0, 1000),
)
def test_a_log_without_noise_gives_the_robot_back(tmp_path_factory, truth, seed):
    rng = np.random.default_rng(seed)
    table = rows(truth, speeds(truth, 40, rng), rng)
    found = identified(write(tmp_path_factory.mktemp("log") / "log.csv", DISPLACEMENTS, table))
    assert list(found.parameters) == list(KINEMATIC)
    for name, estimate in found.parameters.items():
        # the log is integrated in 200 steps: their error is below 1e-5 of the displacement
        assert estimate.value == pytest.approx(getattr(truth, name), abs=3e-5)
        assert estimate.low <= estimate.value <= estimate.high


def test_poses_give_the_same_as_displacements(tmp_path, rng):
    truth = Truth()
    table = rows(truth, speeds(truth, 60, rng), rng)
    posed = table.copy()
    posed[:, 0], posed[:, 3:] = np.cumsum(table[:, 0]), chained(table[:, 3:])
    posed[10:20:2, 3:] = np.nan  # a localisation that is slower than the wheels
    found = identified(write(tmp_path / "log.csv", POSES, posed))
    for name, estimate in found.parameters.items():
        assert estimate.value == pytest.approx(getattr(truth, name), abs=3e-5)


def test_intervals_have_the_width_that_theory_gives(tmp_path, rng):
    # Drives along a line without slip: each interval of length d shows the mean radius with an error of
    # sigma / (speed times time), so n intervals with sigma / (speed times time times sqrt(n)).
    truth, count, sigma = Truth(left_wheel_radius=0.035, right_wheel_radius=0.035), 400, 0.002
    table = rows(truth, np.full((count, 2), 10.0), rng, noise=(sigma, 1e-4))
    found = identified(write(tmp_path / "log.csv", DISPLACEMENTS, table))
    yaw = found.parameters["sensor_yaw"]
    distance = 0.035 * 10.0 * 0.5
    expected = 1.96 * sigma / (distance * np.sqrt(count))
    assert (yaw.high - yaw.low) / 2.0 == pytest.approx(expected, rel=0.25)


def test_outliers_are_left_out(tmp_path, rng):
    truth = Truth()
    table = rows(truth, speeds(truth, 400, rng), rng, slip=0.005, noise=(0.001, 0.002))
    wrong = rng.choice(400, 40, replace=False)
    table[wrong[:20], 3:] += rng.normal(0.0, 0.3, (20, 3))  # failed scan matching
    table[wrong[20:], 1] *= rng.uniform(1.3, 3.0, 20)  # a wheel that spins
    found = identified(write(tmp_path / "log.csv", DISPLACEMENTS, table))
    assert 35 <= found.residual.outliers <= 50  # 1 % of the others are left out too
    for name, estimate in found.parameters.items():
        width = estimate.high - estimate.low
        assert abs(estimate.value - getattr(truth, name)) < width, name
    assert found.parameters["left_wheel_radius"].high - found.parameters["left_wheel_radius"].low < 4e-4


def test_intervals_contain_the_truth_in_95_of_100_robots(tmp_path):
    hits = []
    for seed in range(60):
        rng = np.random.default_rng(seed)
        truth = Truth(sensor_yaw=rng.uniform(-3, 3), wheel_separation=rng.uniform(0.15, 0.3))
        table = rows(truth, speeds(truth, 120, rng), rng, slip=0.01, noise=(0.002, 0.003))
        found = identified(write(tmp_path / "log.csv", DISPLACEMENTS, table))
        hits += [
            estimate.low <= getattr(truth, name) <= estimate.high
            for name, estimate in found.parameters.items()
        ]
    # 360 hits are correlated in sixes: three standard deviations of 60 independent ones
    assert 0.95 - 3 * np.sqrt(0.95 * 0.05 / 60) < np.mean(hits) < 1.0


def test_straight_drives_do_not_show_the_separation_and_the_sensor(tmp_path, rng):
    truth = Truth()
    table = rows(truth, speeds(truth, 200, rng, turns=False), rng, slip=0.01, noise=(0.001, 0.001))
    found = identified(write(tmp_path / "log.csv", DISPLACEMENTS, table))
    assert hidden(found) == ["wheel_separation", "sensor_x", "sensor_y"]
    for name, estimate in found.parameters.items():
        assert estimate.low <= getattr(truth, name) <= estimate.high


def test_equal_wheel_speeds_of_unequal_wheels_show_only_the_yaw(tmp_path, rng):
    # The robot drives one circle for ever: its curvature is the difference of the radii divided by the
    # separation, and only this ratio can be seen. The sensor moves as one beside it would.
    truth = Truth(left_wheel_radius=0.030, right_wheel_radius=0.036)
    table = rows(truth, np.full((200, 2), 8.0), rng, noise=(0.0005, 0.0005))
    found = identified(write(tmp_path / "log.csv", DISPLACEMENTS, table))
    assert {"left_wheel_radius", "right_wheel_radius", "wheel_separation"} <= set(hidden(found))


def test_turns_on_the_spot_show_no_sizes(tmp_path, rng):
    truth = Truth(left_wheel_radius=0.035, right_wheel_radius=0.035)
    table = rows(truth, speeds(truth, 200, rng, drives=False), rng, noise=(0.0005, 0.001))
    found = identified(write(tmp_path / "log.csv", DISPLACEMENTS, table))
    assert hidden(found) == list(KINEMATIC)


def test_a_reference_of_rotation_shows_no_sizes(tmp_path, rng):
    table = rows(Truth(), speeds(Truth(), 200, rng), rng, noise=(0.001, 0.001))
    table[:, 3:5] = np.nan
    found = identified(write(tmp_path / "log.csv", DISPLACEMENTS, table))
    assert hidden(found) == list(KINEMATIC)
    assert found.residual.translation is None


def test_a_reference_of_translation_shows_everything(tmp_path, rng):
    table = rows(Truth(), speeds(Truth(), 300, rng), rng, noise=(0.0005, 0.001))
    table[:, 5] = np.nan
    found = identified(write(tmp_path / "log.csv", DISPLACEMENTS, table))
    for name, estimate in found.parameters.items():
        assert abs(estimate.value - getattr(Truth(), name)) < estimate.high - estimate.low
    assert not hidden(found)


def test_displacements_in_millimetres_and_degrees_are_reported(tmp_path, rng):
    table = rows(Truth(), speeds(Truth(), 200, rng), rng, slip=0.01, noise=(0.001, 0.001))
    table[:, 3:6] *= (1000.0, 1000.0, np.degrees(1.0))
    with pytest.raises(KbotError, match=r"a factor of 97\d\. This factor fits a reference in mm"):
        identified(write(tmp_path / "log.csv", DISPLACEMENTS, table))


@pytest.mark.parametrize("amplitude", [0.003, 0.1, 1.0])
def test_poses_in_degrees_are_reported(tmp_path, rng, amplitude):
    """Also if the robot drives to and fro and hardly turns: its radius would be 7 % too small."""
    truth = Truth(0.036, 0.036, 0.18, 0.0, 0.0, 0.0)
    ahead = rng.uniform(0.1, 0.4, 200) * np.where(np.arange(200) // 10 % 2, -1.0, 1.0)
    turning = np.diff(amplitude * np.sin(0.3 * np.arange(201))) / 0.5
    half = turning * truth.wheel_separation / 2.0
    wheels = np.column_stack([ahead - half, ahead + half]) / truth.left_wheel_radius
    table = rows(truth, wheels, rng, slip=0.003)
    table[:, 0] = np.cumsum(table[:, 0])
    table[:, 3:] = chained(table[:, 3:]) + rng.normal(0.0, 0.001, (200, 3))
    table[:, 5] = np.degrees(table[:, 5])
    with pytest.raises(KbotError, match="the rotations of the reference are in degrees"):
        identified(write(tmp_path / "log.csv", POSES, table))


def test_displacements_in_degrees_are_reported(tmp_path, rng):
    table = rows(Truth(), speeds(Truth(), 200, rng), rng, slip=0.01, noise=(0.001, 0.001))
    table[:, 5] = np.degrees(table[:, 5])
    with pytest.raises(KbotError, match="the rotations of the reference are in degrees"):
        identified(write(tmp_path / "log.csv", DISPLACEMENTS, table))


@pytest.mark.parametrize("turns", [False, True])
def test_an_inaccurate_rotation_in_radians_is_used(tmp_path, rng, turns):
    table = rows(Truth(), speeds(Truth(), 200, rng, turns=turns), rng, slip=0.01, noise=(0.002, 0.2))
    found = identified(write(tmp_path / "log.csv", DISPLACEMENTS, table))
    assert found.residual.rotation > 0.15
    if turns:
        separation = found.parameters["wheel_separation"]
        assert separation.low <= Truth().wheel_separation <= separation.high


@pytest.mark.parametrize(
    ("change", "expected"),
    [
        (lambda speeds: speeds[:, ::-1], "the robot turns against its wheel speeds"),
        (lambda speeds: speeds * (-1.0, 1.0), "a positive speed of the left wheel drives backwards"),
        (lambda speeds: speeds * (1.0, -1.0), "wheel drives backwards"),
    ],
)
def test_wheels_with_wrong_signs_or_sides_are_reported(tmp_path, rng, change, expected):
    table = rows(Truth(), speeds(Truth(), 200, rng), rng, slip=0.01, noise=(0.001, 0.001))
    table[:, 1:3] = change(table[:, 1:3])
    with pytest.raises(KbotError, match=expected):
        identified(write(tmp_path / "log.csv", DISPLACEMENTS, table))


def test_the_result_in_json(tmp_path, rng):
    table = rows(Truth(), speeds(Truth(), 200, rng), rng, slip=0.01, noise=(0.001, 0.001))
    found = identified(write(tmp_path / "log.csv", DISPLACEMENTS, table)).to_json()
    assert list(found) == ["schema", "parameters", "unobservable", "residual", "sources"]
    assert found["schema"] == 1
    radius = found["parameters"]["left_wheel_radius"]
    assert list(radius) == ["value", "unit", "low", "high", "nominal"]
    assert (radius["unit"], radius["nominal"]) == ("m", 0.035)


@pytest.mark.parametrize("correlation", [0.0, 0.6])
def test_half_widths_hold_for_correlated_noise(correlation):
    # the mean of an autoregressive process: intervals of white noise would be half as wide as needed
    hits = 0
    for seed in range(300):
        rng = np.random.default_rng(seed)
        values = rng.normal(0.0, 1.0, 400)
        for index in range(1, 400):
            values[index] += correlation * values[index - 1]
        mean = values.mean()
        hits += abs(mean) <= half_widths(np.ones((400, 1)), values - mean, np.eye(1), 1)[0]
    assert 0.95 - 3 * np.sqrt(0.95 * 0.05 / 300) < hits / 300 < 0.95 + 3 * np.sqrt(0.95 * 0.05 / 300)


def test_the_start_does_not_depend_on_the_description(tmp_path, rng):
    truth = Truth(0.09, 0.092, 0.5, -0.2, 0.1, -2.0)
    table = rows(truth, speeds(truth, 200, rng), rng, slip=0.005, noise=(0.001, 0.001))
    found = identified(write(tmp_path / "log.csv", DISPLACEMENTS, table))
    for name, value in dataclasses.asdict(truth).items():
        assert found.parameters[name].value == pytest.approx(value, abs=0.01)


@pytest.mark.parametrize(
    ("column", "factor", "expected"),
    [
        (slice(1, 3), 30.0 / np.pi, "a factor of 0.10.*fits wheel speeds in rpm"),
        (slice(1, 3), 0.5 / np.pi, "fits wheel speeds in revolutions per second"),
        (slice(3, 5), 1000.0, "fits a reference in mm"),
        (slice(3, 5), 100.0, "fits a reference in cm"),
        (slice(3, 5), 1.0 / 0.3048, "fits a reference in feet"),
        (slice(5, 6), np.degrees(1.0), "are in degrees"),
    ],
)
def test_other_units_are_named(tmp_path, rng, column, factor, expected):
    table = rows(Truth(), speeds(Truth(), 200, rng), rng, slip=0.01, noise=(0.001, 0.001))
    table[:, column] *= factor
    with pytest.raises(KbotError, match=expected):
        identified(write(tmp_path / "log.csv", DISPLACEMENTS, table))


SWAPPED = [0, 1, 2, 4, 3, 5]


@settings(max_examples=25)
@given(
    truth=st.builds(
        Truth,
        sensor_x=lengths(-0.3, 0.3),
        sensor_y=lengths(-0.2, 0.2),
        sensor_yaw=lengths(-3.1, 3.1),
    ),
    noise=st.sampled_from([0.0, 0.001, 0.01]),
    seed=st.integers(0, 1000),
)
def test_only_exchanged_columns_are_refused(tmp_path_factory, truth, noise, seed):
    """At every pose of the sensor. A turn of 0.25 rad in 0.12 m moves the sensor 15 mm to the side."""
    rng = np.random.default_rng(seed)
    table = rows(truth, speeds(truth, 100, rng), rng, slip=0.01, noise=(noise, 0.001))
    path = tmp_path_factory.mktemp("log") / "log.csv"
    identified(write(path, DISPLACEMENTS, table))
    if noise < 0.01:
        with pytest.raises(KbotError, match="displacement_x and displacement_y are exchanged"):
            identified(write(path, DISPLACEMENTS, table[:, SWAPPED]))


@pytest.mark.parametrize("change", [SWAPPED, (1, 1, 1, 1, -1, 1)])
def test_mirrored_poses_are_refused(tmp_path, rng, change):
    table = rows(Truth(), speeds(Truth(), 100, rng), rng, slip=0.01, noise=(0.001, 0.001))
    table[:, 0], table[:, 3:] = np.cumsum(table[:, 0]), chained(table[:, 3:])
    changed = table[:, change] if change is SWAPPED else table * change
    with pytest.raises(KbotError, match="pose_x and pose_y are exchanged, or one of them has the wrong sign"):
        identified(write(tmp_path / "log.csv", POSES, changed))


def test_exact_drives_along_a_line_are_not_taken_as_exchanged(tmp_path, rng):
    truth = Truth(left_wheel_radius=0.035, right_wheel_radius=0.035)
    for yaw in np.linspace(-3.0, 3.0, 7):
        wheels = np.tile(rng.uniform(2.0, 10.0, (40, 1)), 2)
        table = rows(dataclasses.replace(truth, sensor_yaw=yaw), wheels, rng)
        identified(write(tmp_path / "log.csv", DISPLACEMENTS, table))


@pytest.mark.parametrize("count", [4, 6, 10])
def test_short_logs_are_not_taken_as_exchanged(tmp_path, count):
    for seed in range(30):
        rng = np.random.default_rng(seed)
        table = rows(Truth(), speeds(Truth(), count, rng), rng, slip=0.01, noise=(0.005, 0.01))
        identified(write(tmp_path / "log.csv", DISPLACEMENTS, table))
