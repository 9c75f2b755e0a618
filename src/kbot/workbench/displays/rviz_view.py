"""The view controllers of rviz as an eye and what it looks at, and back."""

from __future__ import annotations

import math
from typing import Any

from kbot.workbench.displays.marked_yaml import Marked
from kbot.workbench.displays.rviz_values import FIXED_FRAME
from kbot.workbench.displays.settings import View

PICTURE_HEIGHT = 800
"""Pixels of a picture's height, by which the scale of TopDownOrtho (pixels a metre) is understood."""
HALF_ANGLE = math.radians(16)
"""Half of the angle that the page sees, upwards."""
STRAIGHT_DOWN = 1e-3
ORBITS = ("Orbit", "XYOrbit", "ThirdPersonFollower")


def read_view(views: Marked, notes: list[str]) -> View | None:
    """The current view; where it is of a kind that is not known, a note and None."""
    current = views.value.get("Current") if isinstance(views.value, dict) else None
    if current is None or not isinstance(current.value, dict):
        return None
    fields = current.plain
    kind = str(fields.get("Class")).rpartition("/")[2]
    frame = _target_frame(fields)
    yaw, pitch = _number(fields, "Yaw", 0.785), _number(fields, "Pitch", 0.785)
    if kind in ORBITS:
        target = _triple(fields.get("Focal Point"))
        distance = max(1e-3, _number(fields, "Distance", 10.0))
        away = (math.cos(yaw) * math.cos(pitch), math.sin(yaw) * math.cos(pitch), math.sin(pitch))
        eye = _along(target, away, distance)
        return View(eye, target, follow=kind == "ThirdPersonFollower" or frame != "", frame=frame)
    if kind == "FPS":
        eye = _triple(fields.get("Position"))
        ahead = (math.cos(yaw) * math.cos(pitch), math.sin(yaw) * math.cos(pitch), -math.sin(pitch))
        return View(eye, _along(eye, ahead, 1.0), follow=frame != "", frame=frame)
    if kind == "TopDownOrtho":
        target = (_number(fields, "X", 0.0), _number(fields, "Y", 0.0), 0.0)
        scale = max(1e-3, _number(fields, "Scale", 10.0))
        height = PICTURE_HEIGHT / scale / 2.0 / math.tan(HALF_ANGLE)
        angle = _number(fields, "Angle", 0.0)
        back = (STRAIGHT_DOWN * math.sin(angle), -STRAIGHT_DOWN * math.cos(angle), 1.0)
        return View(_along(target, back, height), target, flat=True, follow=frame != "", frame=frame)
    notes.append(f"the view {fields.get('Class')}, line {current.line}: there is none such here; it is kept")
    return None


def write_view(view: View, views: dict[str, Any], package: str) -> None:
    """Put a view in the place of the current one: TopDownOrtho where it is flat and from above, else Orbit,
    or the follower where that was one."""
    before = views.get("Current")
    old = before if isinstance(before, dict) else {}
    away = [e - t for e, t in zip(view.eye, view.target, strict=True)]
    distance = math.sqrt(sum(v * v for v in away)) or 1.0
    pitch = math.asin(max(-1.0, min(1.0, away[2] / distance)))
    yaw = math.atan2(away[1], away[0])
    x, y, z = view.target
    frame = view.frame or (view.follow and _target_frame(old)) or FIXED_FRAME
    kind = str(old.get("Class")).rpartition("/")[2]
    if view.flat and pitch > math.radians(89):
        new: dict[str, Any] = {
            "Class": f"{package}/TopDownOrtho",
            "Angle": round((yaw + math.pi / 2.0) % (2.0 * math.pi), 6),
            "Scale": round(PICTURE_HEIGHT / (2.0 * distance * math.tan(HALF_ANGLE)), 6),
            "X": x,
            "Y": y,
        }
    elif kind == "FPS":
        ex, ey, ez = view.eye
        new = {
            "Class": f"{package}/FPS",
            "Position": {"X": ex, "Y": ey, "Z": ez},
            "Pitch": round(pitch, 6),
            "Yaw": round((yaw + math.pi) % (2.0 * math.pi), 6),
        }
    else:
        new = {
            "Class": f"{package}/{kind if kind in ORBITS else 'Orbit'}",
            "Distance": round(distance, 6),
            "Focal Point": {"X": x, "Y": y, "Z": z},
            "Pitch": round(pitch, 6),
            "Yaw": round(yaw % (2.0 * math.pi), 6),
        }
    kept = old if new["Class"] == old.get("Class") else {"Name": "Current View", "Near Clip Distance": 0.01}
    views["Current"] = {**kept, **new, "Target Frame": frame}


def _target_frame(fields: dict[str, Any]) -> str:
    """The frame that the view goes along with, from whose origin it is told; empty for the fixed one."""
    frame = str(fields.get("Target Frame", FIXED_FRAME))
    return "" if frame == FIXED_FRAME else frame


def _number(fields: dict[str, Any], name: str, default: float) -> float:
    value = fields.get(name)
    usable = isinstance(value, int | float) and not isinstance(value, bool) and abs(value) < 1e6
    return float(value) if usable and value is not None else default


def _triple(value: object) -> tuple[float, float, float]:
    fields = value if isinstance(value, dict) else {}
    return _number(fields, "X", 0.0), _number(fields, "Y", 0.0), _number(fields, "Z", 0.0)


def _along(
    start: tuple[float, float, float], direction: tuple[float, float, float], distance: float
) -> tuple[float, float, float]:
    x, y, z = (s + d * distance for s, d in zip(start, direction, strict=True))
    return x, y, z
