"""Properties that rviz spreads over several of its own: what colours points, the size of frames."""

from __future__ import annotations

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
"""Where rviz has the values between which colours go, by intensity and by an axis."""
POINTS = {"Color Transformer", "Axis", "Autocompute Value Bounds", *INTENSITY.values()}
TF_LENGTH = 0.2
"""Length in m of the axes that rviz draws at marker scale 1."""


def read_special(kind: DisplayKind, fields: Mapping[str, Marked], read: set[str]) -> dict[str, Value]:
    """What a display of rviz says so; adds to `read` the fields that were looked at."""
    if kind.name in ("LaserScan", "PointCloud2"):
        read.update(POINTS)
        return dict(_read_points(kind, fields))
    if kind.name == "TF" and "Marker Scale" in fields:
        read.add("Marker Scale")
        scale = _number(fields, "Marker Scale")
        return {"length": TF_LENGTH * scale} if scale is not None and scale > 0 else {}
    return {}


def written(kind: DisplayKind, values: Mapping[str, Value]) -> Iterator[tuple[str, Any]]:
    """Labels and values that rviz is to have, the label of one beneath another after a slash."""
    by = values.get("by")
    if by is not None:
        transformers = {ours: theirs for theirs, ours in reversed(COLOUR_BY.items())}
        yield "Color Transformer", transformers.get(str(by), "AxisColor")
        if by in AXES:
            yield "Axis", str(by).upper()
    for name, label in (AXIS if by in AXES else INTENSITY if by == "intensity" else {}).items():
        if name in values:
            yield label, values[name]
    if kind.name == "TF" and values.get("length"):
        yield "Marker Scale", round(float(values["length"]) / TF_LENGTH, 6)


def _read_points(kind: DisplayKind, fields: Mapping[str, Marked]) -> Iterator[tuple[str, Value]]:
    if "Color Transformer" not in fields:
        return
    transformer = str(fields["Color Transformer"].value)
    axis = str(fields["Axis"].value).lower() if "Axis" in fields else "z"
    by = axis if transformer == "AxisColor" else COLOUR_BY.get(transformer, "colour")
    if by not in next(p.options for p in kind.properties if p.name == "by"):
        return
    yield "by", by
    labels = AXIS if by in AXES else INTENSITY if by == "intensity" else {}
    for name, label in labels.items():
        value = _at(fields, label)
        if isinstance(value, bool) if name == "auto" else _is_number(value):
            yield name, value


def _number(fields: Mapping[str, Marked], label: str) -> float | None:
    value = _at(fields, label)
    return float(value) if _is_number(value) else None


def _is_number(value: object) -> bool:
    return isinstance(value, int | float) and not isinstance(value, bool) and abs(value) <= 1e6


def _at(fields: Mapping[str, Marked], label: str) -> Any:  # noqa: ANN401 - what YAML holds
    first, *rest = label.split("/")
    found: Any = fields[first].plain if first in fields else None
    for part in rest:
        found = found.get(part) if isinstance(found, dict) else None
    return found
