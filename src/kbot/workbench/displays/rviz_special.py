"""Properties that rviz spreads over several of its own: what colours points, the size of frames."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from typing import Any

from kbot.workbench.displays.marked_yaml import Marked
from kbot.workbench.displays.property import DisplayKind, Value

COLOUR_BY = {"FlatColor": "colour", "Intensity": "intensity", "RGB8": "rgb", "RGBF32": "rgb"}
AXES = ("x", "y", "z")
INTENSITY = {"auto": "Autocompute Intensity Bounds", "low": "Min Intensity", "high": "Max Intensity"}
AXIS = {
    "auto": "Autocompute Value Bounds/Value",
    "low": "Autocompute Value Bounds/Min Value",
    "high": "Autocompute Value Bounds/Max Value",
}
POINTS = {"Color Transformer", "Axis", "Autocompute Value Bounds", *INTENSITY.values()}
TF_LENGTH = 0.2
"""Length in m of the axes that rviz draws at marker scale 1."""


def read_special(kind: DisplayKind, fields: Mapping[str, Marked], read: set[str]) -> dict[str, Value]:
    """What a display of rviz says so; adds to `read` the fields that were looked at."""
    if kind.name in ("LaserScan", "PointCloud2"):
        read.update(POINTS)
        return _read_colours(kind, fields)
    if kind.name == "TF" and "Marker Scale" in fields:
        read.add("Marker Scale")
        scale = fields["Marker Scale"].value
        is_scale = isinstance(scale, int | float) and 0.0 < scale < math.inf
        return {"length": TF_LENGTH * scale} if is_scale else {}
    return {}


def range_labels(by: Value | None) -> Mapping[str, str]:
    """Where rviz has the values between which the colours of points go: for an axis and for the intensity
    there are fields of their own."""
    return AXIS if by in AXES else INTENSITY if by == "intensity" else {}


def written(kind: DisplayKind, values: Mapping[str, Value]) -> Iterator[tuple[str, Any]]:
    """Labels and values that rviz is to have, the label of one beneath another after a slash."""
    by = values.get("by")
    if by is not None:
        transformers = {ours: theirs for theirs, ours in reversed(COLOUR_BY.items())}
        yield "Color Transformer", transformers.get(str(by), "AxisColor")
        if by in AXES:
            yield "Axis", str(by).upper()
    if kind.name == "TF" and values.get("length"):
        yield "Marker Scale", round(float(values["length"]) / TF_LENGTH, 6)


def _read_colours(kind: DisplayKind, fields: Mapping[str, Marked]) -> dict[str, Value]:
    if "Color Transformer" not in fields:
        return {}
    transformer = str(fields["Color Transformer"].value)
    axis = str(fields["Axis"].value).lower() if "Axis" in fields else "z"
    by = axis if transformer == "AxisColor" else COLOUR_BY.get(transformer, "colour")
    return {"by": by} if by in next(p.options for p in kind.properties if p.name == "by") else {}
