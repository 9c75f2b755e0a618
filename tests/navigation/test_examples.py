"""The examples run, and end where they say."""

import re
import runpy
from pathlib import Path

import pytest

EXAMPLES = Path(__file__).parents[2] / "examples"


def test_a_maze_is_driven(capsys):
    runpy.run_path(str(EXAMPLES / "drive_a_maze.py"))
    said = capsys.readouterr().out
    assert said.startswith("reached after")
    assert float(re.search(r"([\d.]+) mm from the goal", said)[1]) < 12.0


def test_a_wall_is_followed(capsys):
    runpy.run_path(str(EXAMPLES / "own_controller.py"), run_name="__main__")
    x, wall = map(float, re.search(r"x ([\d.]+) m, ([\d.]+) m", capsys.readouterr().out).groups())
    assert x > 2.0
    assert wall == pytest.approx(0.3, abs=0.03)
