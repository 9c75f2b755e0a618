"""The worlds of the BARN challenge, from a folder that holds `worlds.json`.

The file has the worlds by number: `rows` of characters, where `#` is a cylinder, and the published shortest
`path` in m. Source: D. Perille et al., "Benchmarking metric ground navigation", SSRR 2020.
"""

from __future__ import annotations

import os
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property, lru_cache
from itertools import pairwise
from math import dist, pi
from pathlib import Path

from kbot.kinematics.planar_pose import PlanarPose
from kbot.learn.environments.option_checks import LONGEST
from kbot.text import KbotError
from kbot.text.files import read_text
from kbot.text.json_text import parse_json
from kbot.world import World
from kbot.world.builders import cylinder, floor

START, GOAL = PlanarPose(-2.25, 3.0, pi / 2.0), PlanarPose(-2.25, 13.0)
"""Poses (m, rad) in the world's frame. The goal has no heading."""
MAX_SPEED = 2.0, 4.0
"""Highest forward speed in m/s, and turning speed in rad/s."""
ARRIVE, TIME_LIMIT = 1.0, 100.0
"""m and s."""
RADIUS, HEIGHT, SPACING = 0.075, 1.0, 0.15
"""m. Radius and height of the cylinders, and distance between neighbours in a row and between rows."""
LEFT, LOW = -4.425, 0.075
"""m. The place (x, y) of the first cylinder of the first row in the world's frame."""
_MOST_ROWS, _MOST_COLUMNS = 100, 50
"""Those of the challenge have at most 66 rows of 30 columns."""
ROBOT = "jackal_description"
"""The folder of the challenge's robot."""


@dataclass(frozen=True, eq=False)
class BarnWorld:
    """A world of the challenge. `optimal_time` in s is that of the published shortest path at full speed."""

    name: str
    rows: tuple[str, ...]
    optimal_time: float

    @cached_property
    def world(self) -> World:
        posts = [
            cylinder(f"post_{row}_{column}", RADIUS, HEIGHT, LEFT + SPACING * column, LOW + SPACING * row)
            for row, line in enumerate(self.rows)
            for column, sign in enumerate(line)
            if sign == "#"
        ]
        return World(f"barn_{self.name}", (floor(), *posts))


def metric(optimal_time: float, seconds: float | None) -> float:
    """The challenge's metric, at most 0.5. `seconds` is the time from 0.1 m of movement to the goal; None if
    the robot did not arrive or touched something."""
    if seconds is None:
        return 0.0
    return optimal_time / min(max(seconds, 2.0 * optimal_time), 8.0 * optimal_time)


def read_barn_worlds(folder: str | os.PathLike[str]) -> Mapping[str, BarnWorld]:
    """The worlds of a folder, by their number. They are the same objects while the file does not change.

    Raises:
        KbotError: the folder has no `worlds.json`, or the file has another format.
    """
    file = Path(folder) / "worlds.json"
    try:
        status = file.stat()
    except OSError as error:
        raise KbotError(
            f"{file} cannot be read ({error.strerror}): folder must be the one with the worlds of BARN"
        ) from None
    return _read(file, status.st_mtime_ns, status.st_size)


@lru_cache(maxsize=4)
def _read(file: Path, changed: int, size: int) -> Mapping[str, BarnWorld]:
    """The worlds of a file of this time in ns and size. Raises KbotError: it has another format."""
    try:
        data = parse_json(read_text(file))
    except ValueError as error:
        raise KbotError(f"{file} does not hold worlds of BARN: {error}") from None
    if not isinstance(data, dict):
        raise KbotError(f"{file} does not hold worlds of BARN: it is not an object with worlds by number")
    try:
        return {name: _world(name, each) for name, each in data.items()}
    except ValueError as error:
        raise KbotError(f"{file} does not hold worlds of BARN: {error}") from None


def _world(name: str, data: object) -> BarnWorld:
    """A world. Raises ValueError: it has another format."""
    rows, path = (data.get("rows"), data.get("path")) if isinstance(data, dict) else (None, None)
    if not (isinstance(rows, list) and len(rows) <= _MOST_ROWS and all(map(_is_row, rows))):
        raise ValueError(
            f"the rows of world {name} must be at most {_MOST_ROWS} texts of {_MOST_COLUMNS} characters"
        )
    if not (isinstance(path, list) and path and all(map(_is_point, path))):
        raise ValueError(f"the path of world {name} must be points [x, y] in m, at most {LONGEST:g} m from 0")
    points = [(START.x, START.y), *path, (GOAL.x, GOAL.y)]
    optimal = sum(dist(a, b) for a, b in pairwise(points)) / MAX_SPEED[0]
    return BarnWorld(name, tuple(rows), optimal)


def _is_row(value: object) -> bool:
    return isinstance(value, str) and len(value) <= _MOST_COLUMNS


def _is_point(value: object) -> bool:
    """Whether a value is two numbers. NaN is not within the limit."""
    return (
        isinstance(value, list)
        and len(value) == 2
        and all(isinstance(each, int | float) and abs(each) <= LONGEST for each in value)
    )


def barn_robot(folder: str | os.PathLike[str]) -> tuple[str, str]:
    """The file of the challenge's robot, and the folder in which its packages are searched."""
    package = Path(folder) / ROBOT
    return (package / "urdf" / "jackal.urdf").as_posix(), package.as_posix()
