"""Loads a world by the name of a built-in world, or from a file."""

from __future__ import annotations

import os
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from kbot.kinematics.transform import Transform
from kbot.text import KbotError
from kbot.text.errors import reading
from kbot.text.file_kind import WORLD, kind_of_file
from kbot.text.suggest import did_you_mean
from kbot.world.builders import WALL, floor
from kbot.world.builtin.registry import BUILDERS, build_world
from kbot.world.occupancy_files import read_map
from kbot.world.world import Body, Box, Part, World

HEIGHT = 0.3
"""Height of a map's walls in m."""
MOST_WALLS = 20_000
"""Most wall boxes of a map."""
MOST_RUNS = 2_000_000
"""Most runs of occupied cells in the rows of a map. Joining them to boxes takes 1 µs per run."""
OCCUPIED_FROM = 65
"""Occupancy in percent from which a cell is a wall. Only the modes scale and raw have values in between."""


def map_world(path: str) -> World:
    """The world of a map, with walls of 0.3 m at occupied cells. Its origin is the map's.

    Raises:
        KbotError: the file is not a map, or its image cannot be used. See `occupancy_files.read_map`.
    """
    grid = read_map(path)
    step = grid.resolution
    occupied = grid.cells >= OCCUPIED_FROM
    runs = np.count_nonzero(occupied[:, 1:] & ~occupied[:, :-1])
    if runs > MOST_RUNS:
        raise KbotError(f"{path} has {runs} runs of occupied cells in its rows, more than {MOST_RUNS}")
    boxes = rectangles(occupied)
    if len(boxes) > MOST_WALLS:
        raise KbotError(f"{path} needs {len(boxes)} boxes for its walls, more than {MOST_WALLS}")
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
    """Rectangles (first row, first column, end row, end column) that cover each true cell once.

    A rectangle is a run of cells in a row, joined with equal runs in the following rows.
    """
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
    """Load a world. A World is returned unchanged.

    `world` names a built-in world (`boxes`, `maze:size=8,seed=3`), an SDF file (`.world`, `.sdf`, or any name
    if its root is `<sdf>`) or a map (`.yaml`).

    Raises:
        DescriptionError: a file cannot be used. It carries all errors.
        KbotError: the world or a parameter does not exist, or a value is not valid.
    """
    if isinstance(world, World):
        return world
    if not isinstance(world, str | os.PathLike):
        raise KbotError(
            f"world must be a World, a name such as 'empty' or 'maze:size=8', or a file name, not {world!r}"
        )
    text = os.fspath(world)
    suffix = Path(text).suffix.lower()
    if suffix in SDF_SUFFIXES or (Path(text).is_file() and kind_of_file(text) == WORLD):
        from kbot.world.sdf import read_sdf  # imported here for start-up time: built-in worlds do not need it

        with reading(text):
            return read_sdf(text)
    if suffix in MAP_SUFFIXES:
        with reading(text):
            return map_world(text)
    if "/" in text or os.sep in text or Path(text).is_file():
        known = ", ".join((*SDF_SUFFIXES, *MAP_SUFFIXES))
        near = did_you_mean(text, BUILDERS)
        what = f"{text} is not a world: the name of a world file ends in {known}"
        raise KbotError(what + (f"; {near}" if near else ""))
    return build_world(text)
