"""The examples run and print the expected results."""

import csv
import re
import runpy
import subprocess
import sys
from pathlib import Path

import pytest

EXAMPLES = Path(__file__).parents[2] / "examples"


def test_the_maze_example_reaches_its_goal(capsys):
    runpy.run_path(str(EXAMPLES / "drive_a_maze.py"))
    printed = capsys.readouterr().out
    assert printed.startswith("reached after")
    assert float(re.search(r"([\d.]+) mm from the goal", printed)[1]) < 12.0


def test_the_controller_example_follows_a_wall(capsys):
    runpy.run_path(str(EXAMPLES / "own_controller.py"), run_name="__main__")
    x, wall = map(float, re.search(r"x ([\d.]+) m, ([\d.]+) m", capsys.readouterr().out).groups())
    assert x > 2.0
    assert wall == pytest.approx(0.3, abs=0.03)


def test_the_wheel_example_chooses_the_smallest_wheel_that_climbs(tmp_path):
    """A wheel cannot climb a step of its own radius, and the torque of KBot's grows with its radius."""
    script, table = EXAMPLES / "choose_a_wheel" / "choose_a_wheel.py", tmp_path / "wheels.csv"
    words = ["--count", "3", "--jobs", "2", "--csv", str(table)]
    printed = subprocess.run(
        [sys.executable, script, *words], capture_output=True, text=True, check=True
    ).stdout
    assert "2 of 3 wheels climb both steps of 14 mm;\nthe smallest has a radius of 35.0 mm" in printed
    rows = list(csv.DictReader(table.read_text().splitlines()))
    assert [float(row["wheel_radius"]) for row in rows] == pytest.approx([0.02, 0.035, 0.05])
    assert [float(row["climbed"]) for row in rows] == pytest.approx([0.0, 0.028, 0.028], abs=0.002)
    assert all(abs(float(row["odometry_off"])) < 0.01 for row in rows)
