"""Reads and writes occupancy grids in ROS's format: map.yaml and an image (map_server, Nav2)."""

from __future__ import annotations

import io
import json
import math
import os
import reprlib
from collections import defaultdict
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from kbot.kinematics.planar_pose import PlanarPose
from kbot.text import KbotError
from kbot.text.files import read_source, write_bytes, write_text
from kbot.text.render import encodable
from kbot.text.suggest import did_you_mean
from kbot.text.yaml import YamlError, read_yaml
from kbot.world.images import read_picture
from kbot.world.occupancy import FREE, OCCUPIED, UNKNOWN, OccupancyGrid
from kbot.world.world import FURTHEST

OCCUPIED_THRESHOLD, FREE_THRESHOLD = 0.65, 0.196
"""The thresholds of ROS 1's map_saver. With 0.25, its grey for unknown (205) would be read as free."""

SMALLEST, LARGEST = 1e-4, 1e3
"""Bounds of a cell's edge in m: finer than any sensor or larger than any world is an error."""

_BLACK, _GREY, _WHITE = 0, 205, 254
_KEYS = ("image", "resolution", "origin", "negate", "occupied_thresh", "free_thresh", "mode")
_MODES = ("trinary", "scale", "raw")


def write_map(grid: OccupancyGrid, path: str | os.PathLike[str], picture: str = "png") -> Path:
    """Write `path` (a .yaml file) and an image of the same name beside it. Returns the image's path.

    Cells between the thresholds are written as unknown, as map_saver does.

    Raises:
        KbotError: the name does not end in .yaml or is not UTF-8, the image is not png or pgm, or a file
            cannot be written.
    """
    target = Path(path)
    if target.suffix not in (".yaml", ".yml"):
        raise KbotError(f"the file name of a map must end in .yaml, not '{target.name}'")
    if picture not in ("png", "pgm"):
        raise KbotError(f"the image of a map must be png or pgm, not '{picture}'")
    if encodable(target.name) != target.name:
        raise KbotError(
            f"the file name of {target} is not UTF-8, so the map cannot name its image."
            " Choose another file name"
        )
    probability = grid.cells.astype(np.int16) / 100.0
    grey = np.full(grid.cells.shape, _GREY, dtype=np.uint8)
    grey[(grid.cells >= 0) & (probability <= FREE_THRESHOLD)] = _WHITE
    grey[probability >= OCCUPIED_THRESHOLD] = _BLACK
    image = target.with_suffix(f".{picture}")
    write_bytes(image, _encode(grey[::-1], picture))
    origin = ", ".join(repr(float(v)) for v in (grid.origin.x, grid.origin.y, grid.origin.yaw))
    text = (
        f"image: {_quoted(image.name)}\nmode: trinary\nresolution: {grid.resolution!r}\norigin: [{origin}]\n"
        f"negate: 0\noccupied_thresh: {OCCUPIED_THRESHOLD}\nfree_thresh: {FREE_THRESHOLD}\n"
    )
    write_text(target, text)
    return image


def read_map(path: str | os.PathLike[str]) -> OccupancyGrid:
    """Read map.yaml and its image, in the modes trinary, scale and raw.

    Thresholds default to those of map_saver.

    Raises:
        KbotError: a file is missing or cannot be read, or a key is missing or not valid.
    """
    name = os.fspath(path)
    settings, places = _settings(name)
    if not isinstance(settings["image"], str):
        raise KbotError(
            f"{places['image']}: image must be a file name, not {reprlib.repr(settings['image'])}"
        )
    image = Path(name).parent / settings["image"]
    resolution = _number(places, settings, "resolution")
    if not SMALLEST <= resolution < LARGEST:
        where = places["resolution"]
        raise KbotError(f"{where}: resolution must be from {SMALLEST} to {LARGEST:g} m, not {resolution}")
    origin = settings["origin"]
    if (
        not isinstance(origin, list)
        or len(origin) != 3
        or not all(_is_number(v) and abs(v) <= FURTHEST for v in origin)
    ):
        raise KbotError(
            f"{places['origin']}: origin must be [x, y, yaw] in m and rad, up to {FURTHEST:g},"
            f" not {reprlib.repr(origin)}"
        )
    mode = settings.get("mode", "trinary")
    if mode not in _MODES:
        hint = did_you_mean(reprlib.repr(mode), _MODES) or f"choose from {', '.join(_MODES)}"
        raise KbotError(f"{places['mode']}: unknown mode {reprlib.repr(mode)}: {hint}")
    grey, opaque = read_picture(image)
    cells = _interpret(
        grey,
        opaque,
        mode,
        negate=bool(settings.get("negate", 0)),
        occupied=_threshold(places, settings, "occupied_thresh", OCCUPIED_THRESHOLD),
        free=_threshold(places, settings, "free_thresh", FREE_THRESHOLD),
    )
    x, y, yaw = (float(v) for v in origin)
    return OccupancyGrid(np.ascontiguousarray(cells[::-1]), resolution, PlanarPose(x, y, yaw))


def _interpret(
    grey: NDArray[np.float32],
    opaque: NDArray[np.bool_],
    mode: str,
    negate: bool,
    occupied: float,
    free: float,
) -> NDArray[np.int8]:
    """Convert an image's grey values (0..1) to cells, as map_server documents.

    It overwrites the grey values, because an image may have millions.
    """
    cells = np.full(grey.shape, UNKNOWN, dtype=np.int8)
    if mode == "raw":
        np.rint(np.multiply(grey, 255, out=grey), out=grey)
        np.copyto(cells, grey, where=grey <= 100, casting="unsafe")
        return cells
    dark = grey if negate else np.subtract(1.0, grey, out=grey)
    is_free, is_occupied = dark < free, dark > occupied
    if mode == "scale":
        dark -= free
        dark *= 98 / max(occupied - free, 1e-9)
        between = opaque & ~is_free & ~is_occupied
        np.copyto(cells, np.floor(dark, out=dark) + 1, where=between, casting="unsafe")
    cells[is_free] = FREE
    cells[is_occupied] = OCCUPIED
    return cells


def _settings(name: str) -> tuple[dict[str, Any], dict[str, str]]:  # Any: what YAML holds
    """The settings of a map file, and the `file:line:column` of each value."""
    try:
        document = read_yaml(read_source(name))
    except YamlError as error:
        raise KbotError(f"{error.span}: not YAML: {error.problem}") from None
    settings = document.data
    if not isinstance(settings, dict):
        raise KbotError(f"{name} is not a map: it has no keys such as image and resolution")
    others = [key for key in settings if isinstance(key, str) and key not in _KEYS]
    for key in ("image", "resolution", "origin"):
        if key not in settings:
            near = did_you_mean(key, others)
            raise KbotError(f"{name}: the key '{key}' is missing" + (f": {near}" if near else ""))
    for key in ("occupied_thresh", "free_thresh"):
        if key not in settings and (near := did_you_mean(key, others)):
            raise KbotError(f"{name}: the key '{key}' is missing: {near}")
    places = {key: str(place.value) for key in settings if (place := document.place(str(key)))}
    return settings, defaultdict(lambda: name, places)


def _number(places: dict[str, str], settings: dict[str, Any], key: str, default: float = math.nan) -> float:
    value = settings.get(key, default)
    if not _is_number(value):
        raise KbotError(f"{places[key]}: {key} must be a finite number, not {reprlib.repr(value)}")
    return float(value)


def _threshold(places: dict[str, str], settings: dict[str, Any], key: str, default: float) -> float:
    value = _number(places, settings, key, default)
    if not 0.0 <= value <= 1.0:
        raise KbotError(f"{places[key]}: {key} must be from 0 to 1, not {value}")
    return value


def _is_number(value: object) -> bool:
    return isinstance(value, int | float) and not isinstance(value, bool) and math.isfinite(value)


def _encode(grey: NDArray[np.uint8], kind: str) -> bytes:
    if kind == "pgm":
        return b"P5\n%d %d\n255\n" % (grey.shape[1], grey.shape[0]) + grey.tobytes()
    from PIL import Image  # imported here for start-up time

    stream = io.BytesIO()
    Image.fromarray(np.ascontiguousarray(grey)).save(stream, "PNG")
    return stream.getvalue()


def _quoted(name: str) -> str:
    if not name.isprintable():  # YAML would read a line end as a space
        return json.dumps(name)
    return "'" + name.replace("'", "''") + "'"
