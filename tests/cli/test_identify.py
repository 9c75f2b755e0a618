"""Tests `kbot identify`: its table, its JSON, and its exit status."""

import json
import random
from pathlib import Path

import pytest

from kbot.cli.main import run

HEADER = "duration,left_wheel_velocity,right_wheel_velocity,displacement_x,displacement_y,displacement_yaw"


@pytest.fixture
def log(tmp_path: Path) -> Path:
    """A robot with wheels of 40 mm that are 200 mm apart, and a sensor on its axle, without noise.

    It drives 0.2 m ahead, or turns by 0.4 rad on the spot: each wheel then rolls 40 mm.
    """
    ahead, left, right = "1,5,5,0.2,0,0", "1,-1,1,0,0,0.4", "1,1,-1,0,0,-0.4"
    file = tmp_path / "drive.csv"
    file.write_text("\n".join([HEADER, *[ahead, left, ahead, right] * 20]) + "\n")
    return file


def test_the_table_shows_the_robot(log, capsys):
    assert run(["identify", str(log), "kbot"]) == 0
    lines = capsys.readouterr().out.splitlines()
    assert lines[0].split() == ["parameter", "value", "95", "%", "interval", "in", "the", "file"]
    found = {line.split()[0]: line.split() for line in lines[1:7]}
    assert float(found["left_wheel_radius"][1]) == pytest.approx(0.04, abs=1e-6)
    assert float(found["right_wheel_radius"][1]) == pytest.approx(0.04, abs=1e-6)
    assert float(found["wheel_separation"][1]) == pytest.approx(0.2, abs=1e-5)
    assert float(found["sensor_x"][1]) == pytest.approx(0.0, abs=1e-6)
    assert "80 intervals used, 0 outliers left out" in lines


def test_a_gyro_in_degrees_per_second_is_reported(log, capsys):
    """The robot turns by 0.4 rad in 1 s."""
    header, *rows = log.read_text().splitlines()
    turned = [row + f",{float(row.rsplit(',', 1)[1]) * 180.0 / 3.141592653589793:.6f}" for row in rows]
    log.write_text("\n".join([header + ",imu_wz", *turned]) + "\n")
    assert run(["identify", str(log), "kbot"]) == 0
    assert "gyro_scale is 57.3. Check the units and signs of the log" in capsys.readouterr().err


def test_many_outliers_are_reported(log, capsys):
    """In a third of the intervals, the reference moves at random. Few outliers are normal."""
    header, *rows = log.read_text().splitlines()
    draw = random.Random(1)
    wrong = [
        row.rsplit(",", 3)[0] + f",{draw.uniform(-1, 1)},{draw.uniform(-1, 1)},{draw.uniform(-1, 1)}"
        if index % 3 == 0
        else row
        for index, row in enumerate(rows)
    ]
    log.write_text("\n".join([header, *wrong]) + "\n")
    assert run(["identify", str(log), "kbot"]) == 0
    assert (
        "27 outliers left out, more than a fifth: check the reference and the units"
        in capsys.readouterr().out
    )


def test_json_has_the_nominal_values_of_the_file(log, capsys):
    assert run(["identify", str(log), "kbot", "--json", "--sensor", "caster_wheel_link"]) == 2
    captured = capsys.readouterr()
    empty = {"schema": 1, "parameters": {}, "unobservable": [], "residual": {}, "sources": {}}
    assert json.loads(captured.out) == empty
    assert "has no link 'caster_wheel_link'" in captured.err
    assert run(["identify", str(log), "kbot", "--json", "wheel_radius:=0.05"]) == 0
    parameters = json.loads(capsys.readouterr().out)["parameters"]
    assert parameters["left_wheel_radius"]["nominal"] == pytest.approx(0.05)
    assert parameters["sensor_x"]["nominal"] is None  # this robot has no lidar


def test_a_log_that_shows_nothing_has_exit_status_1(tmp_path, capsys):
    file = tmp_path / "turns.csv"
    file.write_text("\n".join([HEADER, *["1,-1,1,,,0.4", "1,1,-1,,,-0.4"] * 20]) + "\n")
    assert run(["identify", str(file), "kbot"]) == 1
    assert "The log does not show:" in capsys.readouterr().out


def test_numbers_that_no_robot_has_are_one_error(tmp_path, capsys):
    file = tmp_path / "huge.csv"
    file.write_text("\n".join([HEADER, *["1e5,1e5,1e5,1e5,1e5,1e5"] * 30]) + "\n")
    assert run(["identify", str(file), "kbot", "--json"]) == 2
    captured = capsys.readouterr()
    assert json.loads(captured.out)["parameters"] == {}
    assert captured.err.startswith(f"error: {file}: ")
    assert captured.err.count("\n") == 1


@pytest.mark.parametrize(
    ("words", "expected"),
    [
        ([], "expected LOG and FILE, got 0 arguments"),
        (["LOG"], "expected LOG and FILE, got 1 argument\n"),
        (["missing.csv", "kbot"], "missing.csv"),
        (["LOG", "missing.xacro"], "missing.xacro"),
        (["LOG", "kbot", "wheel_radios:=1"], "wheel_radios"),
        (["LOG", "kbot", "--yes"], "--yes writes without a question, and needs --fix"),
        (["LOG", "kbot", "--reference", "/scan"], "--reference is a topic of a recording"),
    ],
)
def test_unusable_input_has_one_error(log, capsys, words, expected):
    assert run(["identify", *(str(log) if word == "LOG" else word for word in words)]) == 2
    error = capsys.readouterr().err
    assert expected in error
    assert "Traceback" not in error
