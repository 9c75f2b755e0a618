"""The worlds of the BARN challenge, from a folder that holds `worlds.json`.

The file has the worlds by number: `rows` of characters, where `#` is a cylinder, and the published shortest
`path` in m. Source: D. Perille et al., "Benchmarking metric ground navigation", SSRR 2020.
"""

from __future__ import annotations

import json
import os
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cache
from itertools import pairwise
from math import dist, pi
from pathlib import Path

from kbot.kinematics.planar_pose import PlanarPose
from kbot.text import KbotError
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
ROBOT = "jackal_description"
"""The folder of the challenge's robot."""


@dataclass(frozen=True, eq=False)
class BarnWorld:
    """A world of the challenge. `optimal_time` in s is that of the published shortest path at full speed."""

    name: str
    world: World
    optimal_time: float


def metric(optimal_time: float, seconds: float | None) -> float:
    """The challenge's metric, at most 0.5. `seconds` is the time from 0.1 m of movement to the goal; None if
    the robot did not arrive or touched something."""
    if seconds is None:
        return 0.0
    return optimal_time / min(max(seconds, 2.0 * optimal_time), 8.0 * optimal_time)


@cache
def read_barn_worlds(folder: str | os.PathLike[str]) -> Mapping[str, BarnWorld]:
    """The worlds of a folder, by their number.

    Raises:
        KbotError: the folder has no `worlds.json`, or the file has another format.
    """
    file = Path(folder) / "worlds.json"
    try:
        data = json.loads(file.read_text(encoding="utf-8"))
        return {name: _world(name, each["rows"], each["path"]) for name, each in data.items()}
    except OSError as error:
        raise KbotError(
            f"{file} cannot be read ({error.strerror}): folder must be the one with the worlds of BARN"
        ) from None
    except (ValueError, TypeError, KeyError, AttributeError) as error:
        raise KbotError(f"{file} does not hold worlds of BARN: {error!r}") from None


def _world(name: str, rows: list[str], path: list[list[float]]) -> BarnWorld:
    posts = [
        cylinder(f"post_{row}_{column}", RADIUS, HEIGHT, LEFT + SPACING * column, LOW + SPACING * row)
        for row, line in enumerate(rows)
        for column, sign in enumerate(line)
        if sign == "#"
    ]
    points = [(START.x, START.y), *path, (GOAL.x, GOAL.y)]
    optimal = sum(dist(a, b) for a, b in pairwise(points)) / MAX_SPEED[0]
    return BarnWorld(name, World(f"barn_{name}", (floor(), *posts)), optimal)


def barn_robot(folder: str | os.PathLike[str]) -> tuple[str, str]:
    """The file of the challenge's robot, and the folder in which its packages are searched."""
    package = Path(folder) / ROBOT
    return (package / "urdf" / "jackal.urdf").as_posix(), package.as_posix()
