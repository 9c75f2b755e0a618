"""Configurations of rviz (`.rviz`): the displays that both have, in and out; the rest is named and kept.

rviz 1 and rviz 2 write the same document: displays by class (`rviz/Grid`, `rviz_default_plugins/Grid`) with
properties by the labels they have on screen.
"""

from __future__ import annotations

import copy
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from typing import Any

from kbot.text import KbotError
from kbot.workbench.displays.kinds import GLOBALS, KINDS
from kbot.workbench.displays.marked_yaml import Marked, read_yaml
from kbot.workbench.displays.property import DisplayKind, Property, Value
from kbot.workbench.displays.rviz_parts import hidden, read_links, read_namespaces, show, show_namespace
from kbot.workbench.displays.rviz_special import range_labels, read_special, written
from kbot.workbench.displays.rviz_standard import (
    NOT_IN_RVIZ_1,
    PACKAGES,
    ROS1,
    ROS2,
    Version,
    is_the_robot,
    new_document,
    plugins,
    version_of,
)
from kbot.workbench.displays.rviz_values import read_value, write_value
from kbot.workbench.displays.rviz_view import read_view, write_view
from kbot.workbench.displays.settings import Display, Settings, properties_of

GROUP = "Group"
NOTHING = object()
BY_CLASS = {name: kind for kind in KINDS for name in kind.rviz}
OWN = frozenset({"Class", "Name", "Enabled", "Value", "Displays", "Links", "Frames", "Tree", "Namespaces"})
"""Fields of a display that are no settings of how it looks, or that are read otherwise."""
TOPIC_NAMES = {
    "Image": "Image Topic",
    "Camera": "Image Topic",
    "Marker": "Marker Topic",
    "MarkerArray": "Marker Topic",
}
"""What rviz 1 calls the topic where it is not `Topic`."""


@dataclass(frozen=True, slots=True)
class RvizFile:
    """A configuration as it was read: `settings` of what both have, `notes` of what was left out and why, and
    the whole `document`, so that all that is not known here is written back."""

    settings: Settings
    notes: tuple[str, ...]
    document: Mapping[str, Any]


def read_rviz(text: str, file: str) -> RvizFile:
    """Read a configuration.

    Raises:
        KbotError: no YAML, or none that rviz writes; with file:line.
    """
    document = read_yaml(text, file)
    manager = document.fields.get("Visualization Manager")
    if manager is None:
        raise document.error("no configuration of rviz: there is no 'Visualization Manager'")
    notes: list[str] = []
    fields = manager.fields
    displays = []
    if "Displays" in fields:
        for number, entry in enumerate(_flat(fields["Displays"])):
            display = _read_display(entry, number, notes)
            if display is not None:
                displays.append(display)
    displays.append(Display("World", "World"))  # rviz knows of none, and a simulation has one
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
            notes += [f"{name} of {part}: kept in the file" for name in plugins(holder[part].plain)]
    return RvizFile(Settings(options, tuple(displays), view), tuple(notes), document.plain)


def write_rviz(settings: Settings, original: Mapping[str, Any] | None = None, version: Version = 2) -> str:
    """A configuration that reads as these settings. What `original` has besides stays as it is; without one
    it is a new one for that version of rviz."""
    import yaml

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
            holder[:] = [one for one in holder if one is not entry]
    for display in settings.displays:
        kind = next(kind for kind in KINDS if kind.name == display.kind)
        name = _class_in(kind, version_of(document))
        if shown.get(display.source) is not display and name:
            entry = {"Class": f"{package}/{name}"}
            _write_display(_whole(display, kind), entry, package)
            manager["Displays"].append(entry)
    options = manager.setdefault("Global Options", {})
    for property in GLOBALS:
        if property.rviz and property.name in settings.globals:
            value = settings.globals[property.name]
            _put(options, property.rviz, write_value(property, value, package == ROS1))
    if settings.view is not None:
        write_view(settings.view, manager.setdefault("Views", {}), package)
    return str(yaml.safe_dump(document, sort_keys=False, allow_unicode=True, width=4096))


def unwritten(settings: Settings, version: Version) -> tuple[str, ...]:
    """What that rviz has no display for."""
    have_none = {kind.name for kind in KINDS if not _class_in(kind, version)} - {"World"}
    return tuple(f"{d.name} ({d.kind})" for d in settings.displays if d.kind in have_none)


def _class_in(kind: DisplayKind, version: Version) -> str:
    """What a version of rviz calls a kind, empty where it has none."""
    return next((name for name in kind.rviz if version == 2 or name not in NOT_IN_RVIZ_1), "")


def _flat(entries: Marked) -> Iterator[Marked]:
    """Displays, also those in groups, in their order."""
    for entry in entries.items:
        if _class(entry) == GROUP:
            if "Displays" in entry.fields:
                yield from _flat(entry.fields["Displays"])
        else:
            yield entry


def _plain_flat(entries: list[dict[str, Any]]) -> Iterator[tuple[list[dict[str, Any]], dict[str, Any]]]:
    """The same of a document without marks; each with the list that holds it."""
    for entry in list(entries):
        if str(entry.get("Class")).rpartition("/")[2] == GROUP:
            yield from _plain_flat(entry.get("Displays") or [])
        else:
            yield entries, entry


def _class(entry: Marked) -> str:
    name = entry.fields.get("Class")
    if name is None or not isinstance(name.value, str):
        raise (name or entry).error("a display of rviz has a 'Class'")
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
        notes.append(f"{name} ({cls}), line {entry.line}: no such display here; it is kept in the file")
        return None
    read: set[str] = set()
    values = read_special(kind, fields, read)
    for property in kind.properties:
        labels = _labels(property, kind, values.get("by"))
        read.update(label.partition("/")[0] for label in labels)
        value = _read_property(property, entry, notes, name, labels)
        if value is not NOTHING:
            values[property.name] = value
    values.update(read_links(kind, fields.get("Links")))
    if kind.per_namespace and "Namespaces" in fields:
        values.update(read_namespaces(fields["Namespaces"].plain))
    if kind.per_display and "Visibility" in fields:
        read.add("Visibility")
        values.update({f"{name}/show": False for name in hidden(fields["Visibility"].plain)})
    ignored = sorted(name for name in fields.keys() - OWN - read if not is_the_robot(name, fields[name]))
    if ignored:
        notes.append(f"{name} ({kind.name}), line {entry.line}: not used: {', '.join(ignored)}")
    enabled = fields["Enabled"].value if "Enabled" in fields else True
    return Display(kind.name, name, enabled is not False, values, number)


def _labels(property: Property, kind: DisplayKind, by: Value | None) -> list[str]:
    """Where rviz may have a property of points that are coloured `by` something, or of anything else."""
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
            notes.append(f"{owner}, line {found.line}: {label} is {found.said}, where {error}; it is kept")
    return NOTHING


def _says(property: Property, entry: dict[str, Any], label: str, value: Value) -> bool:
    """Whether a field means that already, in whatever words rviz has for it."""
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
            show(entry, part, value is True)
        elif of_part and kind.per_namespace:
            show_namespace(entry, part, value is True)
        elif of_part:
            _put(entry, f"Links/{part}/{property.rviz}", value)
        if of_part:
            continue
        labels = _labels(property, kind, display.properties.get("by"))
        if package == ROS1:
            labels.reverse()
        label = next((label for label in labels if label in entry), labels[0] if labels else "")
        if label and not _says(property, entry, label, value):
            _put(entry, label, write_value(property, value, package == ROS1))
    for label, said in written(kind, display.properties):
        _put(entry, label, said)


def _whole(display: Display, kind: DisplayKind) -> Display:
    """With initial values, which may be others in rviz, but for those that suit the robot by themselves."""
    initial = {p.name: p.initial for p in kind.properties if p.initial is False or p.initial not in ("", 0.0)}
    return replace(display, properties={**initial, **display.properties})
