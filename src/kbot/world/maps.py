"""Maps as ROS's map_server keeps them: a YAML file and a picture whose dark places become walls."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from kbot.kinematics.transform import Transform
from kbot.text import KbotError, read_source
from kbot.world.builders import WALL, floor
from kbot.world.images import Grey, read_grey
from kbot.world.world import Body, Box, Part, World

HEIGHT = 0.3
MOST_WALLS = 20_000


def read_map(path: str) -> World:
    """The world of a map: walls of 0.3 m where a cell counts as occupied; its origin is the map's.

    Raises:
        DescriptionError: the YAML file cannot be read.
        KbotError: it is no map, or its picture cannot be used.
    """
    import yaml

    try:
        values = yaml.safe_load(read_source(path).text)
    except yaml.YAMLError as error:
        raise KbotError(f"{path} is no YAML: {error}") from None
    if not isinstance(values, dict) or not {"image", "resolution", "origin"} <= set(values):
        raise KbotError(f"{path} is no map: it names an image, a resolution and an origin")
    resolution = _number(path, "resolution", values["resolution"])
    origin = values["origin"]
    if not resolution > 0.0 or not isinstance(origin, list) or len(origin) != 3:
        raise KbotError(f"{path}: resolution is above zero, and origin is [x, y, yaw]")
    x, y, yaw = (_number(path, "origin", value) for value in origin)
    picture = Path(path).parent / str(values["image"])
    occupied = _occupied(read_grey(str(picture)), path, values)
    boxes = rectangles(np.flipud(occupied))
    if len(boxes) > MOST_WALLS:
        raise KbotError(f"{path} has {len(boxes)} pieces of wall, more than {MOST_WALLS}")
    parts = tuple(
        Part(
            Box(((c1 - c0) * resolution, (r1 - r0) * resolution, HEIGHT)),
            Transform.from_xyz_rpy(
                ((c0 + c1) / 2 * resolution, (r0 + r1) / 2 * resolution, HEIGHT / 2), (0.0, 0.0, 0.0)
            ),
            WALL,
        )
        for r0, c0, r1, c1 in boxes
    )
    place = Transform.from_xyz_rpy((x, y, 0.0), (0.0, 0.0, yaw))
    size = 2.5 * resolution * max(occupied.shape)
    return World(Path(path).stem, (floor(max(40.0, size)), Body("map", parts, place)))


def _occupied(grey: Grey, path: str, values: dict[str, object]) -> NDArray[np.bool_]:
    """Cells darker than the threshold, as map_server reckons: occupied = (255 - grey) / 255."""
    threshold = _number(path, "occupied_thresh", values.get("occupied_thresh", 0.65))
    light = grey.astype(np.float64) / 255.0
    share = light if values.get("negate") in (1, True) else 1.0 - light
    dark: NDArray[np.bool_] = share > threshold
    return dark


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


def _number(path: str, name: str, value: object) -> float:
    if isinstance(value, int | float) and not isinstance(value, bool) and np.isfinite(value):
        return float(value)
    raise KbotError(f"{path}: {name} is a finite number, not {value}")
