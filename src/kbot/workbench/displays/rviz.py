"""Read and write rviz's display files (`.rviz`). What KBot does not have is kept in the file and reported.

rviz 1 and rviz 2 write the same document: displays by class (`rviz/Grid`, `rviz_default_plugins/Grid`), with
properties named by their labels on screen.
"""

from __future__ import annotations

import copy
import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from typing import Any, Literal, TypeAlias

from kbot.text import KbotError
from kbot.workbench.displays.display_settings import (
    Display,
    DisplaySettings,
    View,
    checked_value,
    properties_of,
)
from kbot.workbench.displays.kinds import GLOBALS, KINDS
from kbot.workbench.displays.marked_yaml import Marked, read_marked
from kbot.workbench.displays.property import DisplayKind, Property, Value

FIXED_FRAME = "<Fixed Frame>"
PLANES = ("XY", "XZ", "YZ")
SCHEMES = ("map", "costmap", "raw")
RENDERINGS = ("background and overlay", "background", "overlay")
UNCHANGED_CHOICES = frozenset((*PLANES, *SCHEMES, *RENDERINGS))
"""Choices that rviz writes in the same way."""
EQUIVALENT_STYLES = {"flat squares": "squares", "tiles": "squares"}
"""Point styles of rviz that KBot draws as another one."""


def read_value(property: Property, value: object) -> Value:
    """Return a property's value.

    Raises:
        KbotError: it is invalid. The message names the expected value.
    """
    if isinstance(value, dict) and "Value" in value:
        value = value["Value"]
    match property.kind:
        case "colour":
            return _colour(value)
        case "choice":
            by_name = {_bare(option): option for option in property.options}
            if _bare(str(value)) not in by_name:
                raise KbotError(f"expected one of {', '.join(property.options)}")
            return by_name[_bare(str(value))]
        case "frame":
            return "" if value == FIXED_FRAME else checked_value(property, value)
        case "topic" | "text":
            return checked_value(property, value or "")
    return checked_value(property, value)


def write_value(property: Property, value: Value, ros1: bool) -> Any:  # noqa: ANN401 - what YAML holds
    """Return a property's value as rviz reads it."""
    match property.kind:
        case "colour":
            text = str(value) or "#a0a0a4"
            return "; ".join(str(int(text[at : at + 2], 16)) for at in (1, 3, 5))
        case "choice":
            return value if value in UNCHANGED_CHOICES else str(value).capitalize()
        case "frame":
            return value or FIXED_FRAME
        case "topic":
            return value if ros1 else {"Value": value}
        case "number":
            number = float(value)
            return int(number) if number.is_integer() else number
    return value


def _bare(option: str) -> str:
    bare = option.lower().removesuffix(" (flat)").strip()
    return EQUIVALENT_STYLES.get(bare, bare)


def _colour(value: object) -> str:
    """Convert `r; g; b` in 0..255 to `#rrggbb`."""
    try:
        red, green, blue = (int(part) for part in str(value).split(";"))
    except ValueError:
        raise KbotError("expected a colour such as '255; 0; 0'") from None
    if not all(0 <= part <= 255 for part in (red, green, blue)):
        raise KbotError("expected numbers from 0 to 255")
    return f"#{red:02x}{green:02x}{blue:02x}"


PICTURE_HEIGHT = 800
"""Height of the view in pixels that is assumed to convert the scale of TopDownOrtho (pixels per metre)."""
HALF_ANGLE = math.radians(16)
"""Half of the page's vertical field of view."""
STRAIGHT_DOWN = 1e-3
"""Horizontal offset of the eye in a view from above. It sets which way is up in the picture."""
ORBITS = ("Orbit", "XYOrbit", "ThirdPersonFollower")


def read_view(views: Marked, notes: list[str]) -> View | None:
    """Return the current view. For a kind that KBot does not have, add a note and return None."""
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
    notes.append(
        f"the view {fields.get('Class')}, line {current.line}: KBot does not support it; "
        "it is kept in the file"
    )
    return None


def write_view(view: View, views: dict[str, Any], package: str) -> None:
    """Replace the current view.

    A flat view from above is written as TopDownOrtho. Otherwise the kind of the replaced view is kept, and is
    Orbit by default.
    """
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
    """The frame that the view follows and that its coordinates start from, or empty for the fixed frame."""
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


Version: TypeAlias = Literal[1, 2]
ROS1, ROS2 = "rviz", "rviz_default_plugins"
PACKAGES: Mapping[Version, str] = {1: ROS1, 2: ROS2}
"""The package of displays, tools and views in each version."""
NOT_IN_RVIZ_1 = ("TwistStamped", "Wrench")
TOOLS = ("Interact", "MoveCamera", "Select", "FocusCamera", "Measure")
TOPICS_OF_TOOLS = {
    "SetInitialPose": ("/initialpose", "/initialpose"),
    "SetGoal": ("/move_base_simple/goal", "/goal_pose"),
    "PublishPoint": ("/clicked_point", "/clicked_point"),
}
"""Tools that publish, with their topics in rviz 1 and in rviz 2."""

STANDARD = ("rviz", "rviz_common", "rviz_default_plugins")
"""Packages whose panels and tools are part of rviz."""
ROBOT_FIELDS = {"Robot Description": "robot_description", "Description Topic": "/robot_description"}
"""Fields with which rviz 1 and rviz 2 name the robot that KBot displays anyway."""


def plugins(entries: object) -> list[str]:
    """Return the classes of panels or tools that are not part of rviz."""
    tables = [entry for entry in entries if isinstance(entry, dict)] if isinstance(entries, list) else []
    names = [table["Class"] for table in tables if isinstance(table.get("Class"), str)]
    return [name for name in names if name.partition("/")[0] not in STANDARD]


def is_robot_field(label: str, value: Marked) -> bool:
    """Return whether a display's field only refers to the robot on display."""
    name = value.plain.get("Value") if isinstance(value.plain, dict) else value.plain
    return label in ROBOT_FIELDS and name == ROBOT_FIELDS[label]


def version_of(document: Mapping[str, Any]) -> Version:
    """Return the rviz version that wrote a configuration, by the packages in it; 2 if none shows it."""
    return 1 if any(name.startswith(f"{ROS1}/") for name in _classes(document)) else 2


def new_document(version: Version) -> dict[str, Any]:
    """Return a configuration without displays. It has the tools of a new rviz, because rviz takes its tools
    from the file."""
    package = PACKAGES[version]
    tools: list[dict[str, Any]] = [{"Class": f"{package}/{name}"} for name in TOOLS]
    for name, topics in TOPICS_OF_TOOLS.items():
        topic = topics[version - 1]
        tools.append({"Class": f"{package}/{name}", "Topic": topic if version == 1 else {"Value": topic}})
    panels = "rviz" if version == 1 else "rviz_common"
    return {
        "Panels": [{"Class": f"{panels}/{name}", "Name": name} for name in ("Displays", "Views")],
        "Visualization Manager": {
            "Class": "",
            "Displays": [],
            "Enabled": True,
            "Global Options": {},
            "Name": "root",
            "Tools": tools,
            "Value": True,
        },
    }


def _classes(part: object) -> Iterator[str]:
    if isinstance(part, Mapping):
        if isinstance(part.get("Class"), str):
            yield part["Class"]
        part = list(part.values())
    for inner in part if isinstance(part, list) else ():
        yield from _classes(inner)


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
    """Return the values that rviz stores in another form, and add their fields to `read`."""
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
    """Return rviz's fields for the colour range of points: axes and intensity have separate ones."""
    return AXIS if by in AXES else INTENSITY if by == "intensity" else {}


def special_fields(kind: DisplayKind, values: Mapping[str, Value]) -> Iterator[tuple[str, Any]]:
    """Yield labels and values to write that rviz stores in another form. `A/B` is the label `B` under `A`."""
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


def read_links(kind: DisplayKind, links: Marked | None, notes: list[str]) -> dict[str, Value]:
    """Return the values in `Links` that differ from the initial ones, as `link/property`."""
    found: dict[str, Value] = {}
    for link, entry in links.value.items() if links is not None and isinstance(links.value, dict) else ():
        for property in kind.per_link if isinstance(entry.value, dict) else ():
            value = _read_property(property, entry, notes, link)
            if value is not NOTHING and value != property.initial:
                found[f"{link}/{property.name}"] = value
    return found


def hidden_displays(visibility: object, above: bool = True) -> Iterator[str]:
    """Yield the displays that a camera's `Visibility` hides, by themselves or with their group."""
    if not isinstance(visibility, dict):
        return
    is_seen = above and visibility.get("Value") is not False
    for name, value in visibility.items():
        if isinstance(value, dict):
            yield from hidden_displays(value, is_seen)
        elif name != "Value" and not (is_seen and value is not False):
            yield str(name)


def set_visibility(camera: dict[str, Any], name: str, is_seen: bool) -> None:
    """Set in a camera's `Visibility` whether a display is visible: at its existing entry, or at the end."""
    visibility = camera.get("Visibility")
    if not isinstance(visibility, dict):
        visibility = camera["Visibility"] = {"Value": True}
    (_holder(visibility, name) or visibility)[name] = is_seen


def _holder(visibility: dict[str, Any], name: str) -> dict[str, Any] | None:
    if isinstance(visibility.get(name), bool):
        return visibility
    groups = (group for group in visibility.values() if isinstance(group, dict))
    return next((found for group in groups if (found := _holder(group, name)) is not None), None)


def read_namespaces(namespaces: object) -> dict[str, Value]:
    """Return what `Namespaces` hides, as `namespace/show`."""
    entries = namespaces.items() if isinstance(namespaces, dict) else ()
    return {f"{name}/show": False for name, is_seen in entries if is_seen is False}


def set_namespace_visibility(markers: dict[str, Any], name: str, is_seen: bool) -> None:
    """Set in a display's `Namespaces` whether the markers of a namespace are visible."""
    namespaces = markers.get("Namespaces")
    if not isinstance(namespaces, dict):
        namespaces = markers["Namespaces"] = {}
    namespaces[name] = is_seen


GROUP = "Group"
NOTHING = object()
BY_CLASS = {name: kind for kind in KINDS for name in kind.rviz}
SEPARATE_FIELDS = frozenset(
    {"Class", "Name", "Enabled", "Value", "Displays", "Links", "Frames", "Tree", "Namespaces"}
)
"""Fields of a display that are not settings of its look, or that are read separately."""
TOPIC_NAMES = {
    "Image": "Image Topic",
    "Camera": "Image Topic",
    "Marker": "Marker Topic",
    "MarkerArray": "Marker Topic",
}
"""rviz 1's labels of the topic where they are not `Topic`."""


@dataclass(frozen=True, slots=True)
class RvizFile:
    """An rviz configuration.

    `settings` are those that KBot has too, and `notes` report what was skipped and why. The whole `document`
    is kept, so that unknown parts are written back.
    """

    settings: DisplaySettings
    notes: tuple[str, ...]
    document: Mapping[str, Any]


def read_rviz(text: str, file: str) -> RvizFile:
    """Read a configuration.

    Raises:
        KbotError: malformed YAML, or not an rviz configuration; with file:line.
    """
    document = read_marked(text, file)
    manager = document.fields.get("Visualization Manager")
    if manager is None:
        raise document.error("not an rviz configuration: 'Visualization Manager' is missing")
    notes: list[str] = []
    fields = manager.fields
    displays = []
    if "Displays" in fields:
        for number, entry in enumerate(_flat(fields["Displays"])):
            display = _read_display(entry, number, notes)
            if display is not None:
                displays.append(display)
    displays.append(Display("World", "World"))  # rviz does not have a world, and a simulation does
    options = {}
    if "Global Options" in fields:
        found = fields["Global Options"]
        for property in GLOBALS:
            value = _read_property(property, found, notes, "Global Options")
            if value is not NOTHING:
                options[property.name] = value
    view = read_view(fields["Views"], notes) if "Views" in fields else None
    for holder, part in ((document.fields, "Panels"), (fields, "Tools")):
        if part in holder:
            notes += [
                f"{name} in {part}: KBot does not support it; it is kept in the file"
                for name in plugins(holder[part].plain)
            ]
    return RvizFile(DisplaySettings(options, tuple(displays), view), tuple(notes), document.plain)


def write_rviz(
    settings: DisplaySettings, original: Mapping[str, Any] | None = None, version: Version = 2
) -> str:
    """Return a configuration with these settings.

    Everything else in `original` is kept. Without `original` the configuration is a new one for that version
    of rviz.
    """
    import yaml  # imported lazily, for a fast start-up

    document: dict[str, Any] = copy.deepcopy(dict(original)) if original else new_document(version)
    manager = document["Visualization Manager"]
    package = PACKAGES[version_of(document)]
    entries = list(_plain_flat(manager.setdefault("Displays", [])))
    shown = {display.source: display for display in settings.displays if 0 <= display.source < len(entries)}
    for number, (holder, entry) in enumerate(entries):
        if _kind(str(entry.get("Class"))) is None:
            continue
        if number in shown:
            _write_display(shown[number], entry, package)
        else:
            holder[:] = [other for other in holder if other is not entry]
    for display in settings.displays:
        kind = next(kind for kind in KINDS if kind.name == display.kind)
        name = _class_in(kind, version_of(document))
        if shown.get(display.source) is not display and name:
            entry = {"Class": f"{package}/{name}"}
            _write_display(_with_initial_values(display, kind), entry, package)
            manager["Displays"].append(entry)
    options = manager.setdefault("Global Options", {})
    for property in GLOBALS:
        if property.rviz and property.name in settings.globals:
            value = settings.globals[property.name]
            _put(options, property.rviz, write_value(property, value, package == ROS1))
    if settings.view is not None:
        write_view(settings.view, manager.setdefault("Views", {}), package)
    return str(yaml.safe_dump(document, sort_keys=False, allow_unicode=True, width=4096))


def unsupported(settings: DisplaySettings, version: Version) -> tuple[str, ...]:
    """Return the displays that this version of rviz does not have."""
    have_none = {kind.name for kind in KINDS if not _class_in(kind, version)} - {"World"}
    return tuple(f"{d.name} ({d.kind})" for d in settings.displays if d.kind in have_none)


def _class_in(kind: DisplayKind, version: Version) -> str:
    """Return the class of a kind in a version of rviz, or an empty string."""
    return next((name for name in kind.rviz if version == 2 or name not in NOT_IN_RVIZ_1), "")


def _flat(entries: Marked) -> Iterator[Marked]:
    """Yield displays in their order, including those in groups."""
    for entry in entries.items:
        if _class(entry) == GROUP:
            if "Displays" in entry.fields:
                yield from _flat(entry.fields["Displays"])
        else:
            yield entry


def _plain_flat(entries: list[dict[str, Any]]) -> Iterator[tuple[list[dict[str, Any]], dict[str, Any]]]:
    """Yield the displays of a document without marks, each with the list that holds it."""
    for entry in list(entries):
        if str(entry.get("Class")).rpartition("/")[2] == GROUP:
            yield from _plain_flat(entry.get("Displays") or [])
        else:
            yield entries, entry


def _class(entry: Marked) -> str:
    name = entry.fields.get("Class")
    if name is None or not isinstance(name.value, str):
        raise (name or entry).error("an rviz display needs a 'Class'")
    return name.value.rpartition("/")[2]


def _kind(name: str) -> DisplayKind | None:
    package, _, own = name.rpartition("/")
    return BY_CLASS.get(own) if package in (ROS1, ROS2, "rviz_common", "") else None


def _read_display(entry: Marked, number: int, notes: list[str]) -> Display | None:
    fields = entry.fields
    _class(entry)
    cls = str(fields["Class"].value)
    name = str(fields["Name"].plain) if "Name" in fields else cls.rpartition("/")[2]
    kind = _kind(cls)
    if kind is None:
        notes.append(
            f"{name} ({cls}), line {entry.line}: KBot does not support this display; it is kept in the file"
        )
        return None
    read: set[str] = set()
    values = read_special(kind, fields, read)
    for property in kind.properties:
        labels = _labels(property, kind, values.get("by"))
        read.update(label.partition("/")[0] for label in labels)
        value = _read_property(property, entry, notes, name, labels)
        if value is not NOTHING:
            values[property.name] = value
    values.update(read_links(kind, fields.get("Links"), notes))
    if kind.per_namespace and "Namespaces" in fields:
        values.update(read_namespaces(fields["Namespaces"].plain))
    if kind.per_display and "Visibility" in fields:
        read.add("Visibility")
        values.update({f"{name}/show": False for name in hidden_displays(fields["Visibility"].plain)})
    ignored = sorted(
        name for name in fields.keys() - SEPARATE_FIELDS - read if not is_robot_field(name, fields[name])
    )
    if ignored:
        notes.append(f"{name} ({kind.name}), line {entry.line}: not used: {', '.join(ignored)}")
    enabled = fields["Enabled"].value if "Enabled" in fields else True
    return Display(kind.name, name, enabled is not False, values, number)


def _labels(property: Property, kind: DisplayKind, by: Value | None) -> list[str]:
    """Return rviz's possible labels of a property. `by` is what points are coloured by."""
    label = property.rviz or range_labels(by).get(property.name, "")
    labels = [label] if label else []
    if property.name == "topic" and kind.name in TOPIC_NAMES:
        labels.append(TOPIC_NAMES[kind.name])
    return labels


def _read_property(
    property: Property, entry: Marked, notes: list[str], owner: str, labels: list[str] | None = None
) -> Any:  # noqa: ANN401 - a value or NOTHING
    for label in [property.rviz] if labels is None else labels:
        found = entry.at(label) if label else None
        if found is None:
            continue
        try:
            return read_value(property, found.plain)
        except KbotError as error:
            notes.append(
                f"{owner}, line {found.line}: {label} is {found.shown}: {error}; it is kept in the file"
            )
    return NOTHING


def _has_value(property: Property, entry: dict[str, Any], label: str, value: Value) -> bool:
    """Return whether a field already has that value, in any of the forms that rviz accepts."""
    found: Any = entry
    for part in label.split("/"):
        found = found.get(part) if isinstance(found, dict) else None
    try:
        return found is not None and read_value(property, found) == value
    except KbotError:
        return False


def _put(fields: dict[str, Any], label: str, value: object) -> None:
    *above, last = label.split("/")
    for part in above:
        inner = fields.setdefault(part, {})
        if not isinstance(inner, dict):
            inner = fields[part] = {}
        fields = inner
    kept = fields.get(last)
    if isinstance(kept, dict) and "Value" in kept:
        kept.update(value if isinstance(value, dict) else {"Value": value})
    else:
        fields[last] = value


def _write_display(display: Display, entry: dict[str, Any], package: str) -> None:
    kind = next(kind for kind in KINDS if kind.name == display.kind)
    entry["Name"] = display.name
    entry["Enabled"] = entry["Value"] = display.enabled
    properties = properties_of(kind, display.properties)
    for name, value in display.properties.items():
        property = properties[name]
        part, of_part, _ = name.rpartition("/")
        if of_part and kind.per_display:
            set_visibility(entry, part, value is True)
        elif of_part and kind.per_namespace:
            set_namespace_visibility(entry, part, value is True)
        elif of_part:
            _put(entry, f"Links/{part}/{property.rviz}", value)
        if of_part:
            continue
        labels = _labels(property, kind, display.properties.get("by"))
        if package == ROS1:
            labels.reverse()
        label = next((label for label in labels if label in entry), labels[0] if labels else "")
        if label and not _has_value(property, entry, label, value):
            _put(entry, label, write_value(property, value, package == ROS1))
    for label, value in special_fields(kind, display.properties):
        _put(entry, label, value)


def _with_initial_values(display: Display, kind: DisplayKind) -> Display:
    """Add the initial values to a display, because rviz may have other ones.

    Empty and zero values are omitted, because they mean that KBot chooses.
    """
    initial = {p.name: p.initial for p in kind.properties if p.initial is False or p.initial not in ("", 0.0)}
    return replace(display, properties={**initial, **display.properties})
