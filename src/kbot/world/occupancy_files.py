"""Occupancy grids as ROS writes and reads them: map.yaml beside a picture (map_server, Nav2)."""

from __future__ import annotations

import io
import math
import os
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from kbot.kinematics.odometry import PlanarPose
from kbot.text import KbotError
from kbot.text.files import read_source, write_bytes, write_text
from kbot.text.suggest import did_you_mean
from kbot.text.yaml_text import load_yaml
from kbot.world.images import read_picture
from kbot.world.occupancy import FREE, OCCUPIED, UNKNOWN, OccupancyGrid

OCCUPIED_THRESHOLD, FREE_THRESHOLD = 0.65, 0.196
"""As map_saver of ROS 1 writes them; with 0.25 its grey for unknown (205) would read as free."""

_BLACK, _GREY, _WHITE = 0, 205, 254
_KEYS = ("image", "resolution", "origin", "negate", "occupied_thresh", "free_thresh", "mode")
_MODES = ("trinary", "scale", "raw")


def write_map(grid: OccupancyGrid, path: str | os.PathLike[str], picture: str = "png") -> Path:
    """Write `path` (a .yaml) and a picture of the same name beside it; the picture's path is returned.

    What is neither free nor occupied for certain is written as unknown, as map_saver does.

    Raises:
        KbotError: a name that does not end in .yaml, another picture than png or pgm, or no place to write.
    """
    target = Path(path)
    if target.suffix not in (".yaml", ".yml"):
        raise KbotError(f"a map is named by its .yaml file, not '{target.name}'")
    if picture not in ("png", "pgm"):
        raise KbotError(f"a map's picture is a png or a pgm, not '{picture}'")
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
    """Read map.yaml and its picture, in the modes trinary, scale and raw. Thresholds that are not given are
    those of map_saver.

    Raises:
        KbotError: a file is missing or not readable, a key is missing, or of no use.
    """
    name = os.fspath(path)
    settings, places = _settings(name)
    image = Path(name).parent / str(settings["image"])
    resolution = _number(places, settings, "resolution")
    if not 0.0 < resolution < 1e3:
        raise KbotError(f"{places['resolution']}: resolution is a length in m above 0, not {resolution}")
    origin = settings["origin"]
    if not isinstance(origin, list) or len(origin) != 3 or not all(_is_number(v) for v in origin):
        raise KbotError(f"{places['origin']}: origin is [x, y, yaw] in m and rad, not {origin}")
    mode = settings.get("mode", "trinary")
    if mode not in _MODES:
        hint = did_you_mean(str(mode), _MODES) or f"there are {', '.join(_MODES)}"
        raise KbotError(f"{places['mode']}: there is no mode '{mode}': {hint}")
    grey, opaque = read_picture(image)
    cells = _interpret(
        grey,
        opaque,
        mode,
        negate=bool(settings.get("negate", 0)),
        occupied=_number(places, settings, "occupied_thresh", OCCUPIED_THRESHOLD),
        free=_number(places, settings, "free_thresh", FREE_THRESHOLD),
    )
    x, y, yaw = (float(v) for v in origin)
    return OccupancyGrid(np.ascontiguousarray(cells[::-1]), resolution, PlanarPose(x, y, yaw))


def _interpret(
    grey: NDArray[np.float64],
    opaque: NDArray[np.bool_],
    mode: str,
    negate: bool,
    occupied: float,
    free: float,
) -> NDArray[np.int8]:
    """Cells of a picture's greys (0..1), as map_server's documentation has it."""
    if mode == "raw":
        raw = np.rint(grey * 255)
        return np.where(raw <= 100, raw, UNKNOWN).astype(np.int8)
    dark = grey if negate else 1.0 - grey
    between: float | NDArray[np.float64] = UNKNOWN
    if mode == "scale":
        between = np.where(opaque, 1 + np.floor(98 * (dark - free) / max(occupied - free, 1e-9)), UNKNOWN)
    return np.where(dark > occupied, OCCUPIED, np.where(dark < free, FREE, between)).astype(np.int8)


def _settings(name: str) -> tuple[dict[str, Any], dict[str, str]]:
    """What a map says, and the `file:line:column` of each value."""
    import yaml

    text = read_source(name).text
    try:
        settings = load_yaml(text)
        tree = yaml.compose(text, yaml.SafeLoader)
    except yaml.YAMLError as error:
        mark = getattr(error, "problem_mark", None)
        where = f":{mark.line + 1}:{mark.column + 1}" if mark else ""
        raise KbotError(f"{name}{where}: not YAML: {getattr(error, 'problem', error)}") from None
    if not isinstance(settings, dict):
        raise KbotError(f"{name} is no map: it has no keys such as image and resolution")
    others = [str(key) for key in settings if key not in _KEYS]
    for key in ("image", "resolution", "origin"):
        if key not in settings:
            near = did_you_mean(key, others)
            raise KbotError(f"{name}: the key '{key}' is missing" + (f": {near}" if near else ""))
    for key in ("occupied_thresh", "free_thresh"):
        if key not in settings and (near := did_you_mean(key, others)):
            raise KbotError(f"{name}: the key '{key}' is missing: {near}")
    marks = {str(key.value): value.start_mark for key, value in (tree.value if tree else ())}
    return settings, {key: f"{name}:{mark.line + 1}:{mark.column + 1}" for key, mark in marks.items()}


def _number(places: dict[str, str], settings: dict[str, Any], key: str, default: float = math.nan) -> float:
    value = settings.get(key, default)
    if not _is_number(value):
        raise KbotError(f"{places[key]}: {key} is a finite number, not {value!r}")
    return float(value)


def _is_number(value: object) -> bool:
    return isinstance(value, int | float) and not isinstance(value, bool) and math.isfinite(value)


def _encode(grey: NDArray[np.uint8], kind: str) -> bytes:
    if kind == "pgm":
        return b"P5\n%d %d\n255\n" % (grey.shape[1], grey.shape[0]) + grey.tobytes()
    from PIL import Image

    stream = io.BytesIO()
    Image.fromarray(np.ascontiguousarray(grey)).save(stream, "PNG")
    return stream.getvalue()


def _quoted(name: str) -> str:
    return "'" + name.replace("'", "''") + "'"
