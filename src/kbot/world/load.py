"""Loads a world from a built-in world's name with parameters, or from a file."""

from __future__ import annotations

import os
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from kbot.kinematics.transform import Transform
from kbot.text import KbotError
from kbot.text.errors import reading
from kbot.text.suggest import did_you_mean
from kbot.world.builders import WALL, floor
from kbot.world.builtin.registry import BUILDERS, build_world
from kbot.world.occupancy_files import read_map
from kbot.world.world import Body, Box, Part, World

HEIGHT = 0.3
MOST_WALLS = 20_000
MOST_RUNS = 2_000_000
"""Pieces of wall in the single rows of a picture, which take 1 µs each to put together."""
OCCUPIED_FROM = 65
"""Percent; where a map's mode keeps shades, what is likelier than this is a wall."""


def map_world(path: str) -> World:
    """The world of a map: walls of 0.3 m where a cell counts as occupied; its origin is the map's.

    Raises:
        KbotError: it is no map, or its picture cannot be used; see `occupancy_files.read_map`.
    """
    grid = read_map(path)
    step = grid.resolution
    occupied = grid.cells >= OCCUPIED_FROM
    runs = np.count_nonzero(occupied[:, 1:] & ~occupied[:, :-1])
    if runs > MOST_RUNS:
        raise KbotError(f"{path} has {runs} pieces of wall in its rows, more than {MOST_RUNS}")
    boxes = rectangles(occupied)
    if len(boxes) > MOST_WALLS:
        raise KbotError(f"{path} has {len(boxes)} pieces of wall, more than {MOST_WALLS}")
    parts = tuple(
        Part(
            Box(((c1 - c0) * step, (r1 - r0) * step, HEIGHT)),
            Transform.from_xyz_rpy(((c0 + c1) / 2 * step, (r0 + r1) / 2 * step, HEIGHT / 2), (0.0, 0.0, 0.0)),
            WALL,
        )
        for r0, c0, r1, c1 in boxes
    )
    origin = grid.origin
    place = Transform.from_xyz_rpy((origin.x, origin.y, 0.0), (0.0, 0.0, origin.yaw))
    return World(Path(path).stem, (floor(max(40.0, 2.5 * max(grid.size))), Body("map", parts, place)))


def rectangles(cells: NDArray[np.bool_]) -> list[tuple[int, int, int, int]]:
    """Rectangles (row, column, row beyond, column beyond) that cover the true cells once: runs along a
    row, joined with the same run of the rows that follow."""
    found: list[tuple[int, int, int, int]] = []
    growing: dict[tuple[int, int], int] = {}
    rows = cells.shape[0]
    for row in range(rows + 1):
        runs = _runs(cells[row]) if row < rows else set()
        for run in [run for run in growing if run not in runs]:
            found.append((growing.pop(run), run[0], row, run[1]))
        for run in runs:
            growing.setdefault(run, row)
    return sorted(found)


def _runs(row: NDArray[np.bool_]) -> set[tuple[int, int]]:
    edges = np.flatnonzero(np.diff(np.concatenate([[False], row, [False]]).astype(np.int8)))
    return {(int(a), int(b)) for a, b in zip(edges[::2], edges[1::2], strict=True)}


SDF_SUFFIXES = (".world", ".sdf")
MAP_SUFFIXES = (".yaml", ".yml")


def load_world(world: str | os.PathLike[str] | World = "empty") -> World:
    """The world a text names: a built-in one (`boxes`, `maze:size=8,seed=3`), an SDF file (`.world`,
    `.sdf`), or a map (`.yaml` beside its picture). A World is handed through.

    Raises:
        DescriptionError: a file that cannot be used; everything that is wrong with it.
        KbotError: there is no such world, parameter or value.
    """
    if isinstance(world, World):
        return world
    if not isinstance(world, str | os.PathLike):
        raise KbotError(
            f"a world is a World, a name such as 'empty' or 'maze:size=8', or a file, not {world!r}"
        )
    text = os.fspath(world)
    suffix = Path(text).suffix.lower()
    if suffix in SDF_SUFFIXES:
        from kbot.world.sdf import read_sdf  # built-in worlds need no reader: start-up time

        with reading(text):
            return read_sdf(text)
    if suffix in MAP_SUFFIXES:
        with reading(text):
            return map_world(text)
    if "/" in text or os.sep in text or Path(text).is_file():
        known = ", ".join((*SDF_SUFFIXES, *MAP_SUFFIXES))
        near = did_you_mean(text, BUILDERS)
        raise KbotError(f"{text} is no world: a file of one ends in {known}" + (f"; {near}" if near else ""))
    return build_world(text)
