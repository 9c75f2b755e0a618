"""Display settings as plain data: checked, read from and written to `.kbot.yaml`."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from typing import Any

from kbot.text import KbotError
from kbot.text.suggest import did_you_mean
from kbot.workbench.displays.kinds import GLOBALS, KINDS
from kbot.workbench.displays.marked_yaml import Marked, read_marked
from kbot.workbench.displays.property import DisplayKind, Property, Value

MOST_DISPLAYS = 200
BY_NAME = {kind.name: kind for kind in KINDS}
HEADER = "# Displays of KBot's workbench: kbot view ROBOT --config THIS\n"


@dataclass(frozen=True, slots=True)
class Display:
    """One display. Properties that are missing have their initial value.

    `source` is the display's index in the rviz file it comes from, or -1.
    """

    kind: str
    name: str
    enabled: bool = True
    properties: Mapping[str, Value] = field(default_factory=dict)
    source: int = -1


@dataclass(frozen=True, slots=True)
class View:
    """The viewpoint: `eye` and `target` in m along the axes of the fixed frame.

    Their origin is that of `frame`, or of the fixed frame. `flat` is without perspective. With `follow` the
    view moves with `frame`, or with the robot's root if `frame` is empty.
    """

    eye: tuple[float, float, float]
    target: tuple[float, float, float]
    flat: bool = False
    follow: bool = True
    frame: str = ""


@dataclass(frozen=True, slots=True)
class DisplaySettings:
    globals: Mapping[str, Value]
    displays: tuple[Display, ...]
    view: View | None = None


def read_settings(text: str, file: str) -> DisplaySettings:
    """Return the settings in a `.kbot.yaml`.

    Raises:
        KbotError: malformed YAML, an unknown kind or property, or an invalid value; with file:line.
    """
    document = read_marked(text, file)
    return check(document)


def check(document: Marked) -> DisplaySettings:
    """Return the settings in a mapping, from a file or from a page.

    Raises:
        KbotError: what is wrong, and where.
    """
    entries = document.fields
    _require_known(document, entries, ("globals", "displays", "view"))
    displays = entries["displays"].items if "displays" in entries else []
    if len(displays) > MOST_DISPLAYS:
        raise document.error(f"{len(displays)} displays: the limit is {MOST_DISPLAYS}")
    options = {property.name: property for property in GLOBALS}
    view = entries.get("view")
    return DisplaySettings(
        _values(entries["globals"], options, "global option") if "globals" in entries else {},
        tuple(_display(entry) for entry in displays),
        _view(view) if view is not None and view.value is not None else None,
    )


def write_settings(settings: DisplaySettings) -> str:
    """Return the text of a `.kbot.yaml` with these settings."""
    import yaml  # imported lazily, for a fast start-up

    return HEADER + str(yaml.safe_dump(plain(settings, sources=False), sort_keys=False, allow_unicode=True))


def plain(settings: DisplaySettings, *, sources: bool = True) -> dict[str, object]:
    """Return the settings as a mapping that `check` accepts, with or without the `sources` of displays."""
    found: dict[str, object] = {
        "globals": dict(settings.globals),
        "displays": [
            {
                "kind": display.kind,
                "name": display.name,
                "enabled": display.enabled,
                "properties": dict(display.properties),
                **({"source": display.source} if sources else {}),
            }
            for display in settings.displays
        ],
    }
    if settings.view is not None:
        view = settings.view
        found["view"] = {
            "eye": [round(v, 6) for v in view.eye],
            "target": [round(v, 6) for v in view.target],
            "flat": view.flat,
            "follow": view.follow,
            **({"frame": view.frame} if view.frame else {}),
        }
    return found


def marked(value: object, file: str) -> Marked:
    """Convert a page's JSON to the type that `check` accepts."""
    if isinstance(value, dict):
        return Marked({str(name): marked(part, file) for name, part in value.items()}, file, 1)
    return Marked([marked(part, file) for part in value] if isinstance(value, list) else value, file, 1)


def checked_value(property: Property, value: object) -> Value:
    """Return a property's value.

    Raises:
        KbotError: it is of another kind or out of range. The message names the expected value.
    """
    match property.kind:
        case "switch":
            if isinstance(value, bool):
                return value
            raise KbotError("expected true or false")
        case "number":
            if isinstance(value, bool) or not isinstance(value, int | float) or not math.isfinite(value):
                raise KbotError("expected a number")
            if not property.low <= value <= property.high:
                raise KbotError(f"expected {property.low:g} to {property.high:g}")
            return float(value)
        case "choice":
            if isinstance(value, str) and value in property.options:
                return value
            raise KbotError(f"expected one of {', '.join(property.options)}")
        case "colour":
            if isinstance(value, str) and (value == property.initial == "" or _is_colour(value)):
                return value
            raise KbotError("expected a colour such as '#ff8800'")
    if isinstance(value, str) and len(value) <= 256:
        return value
    raise KbotError("expected a string of at most 256 characters")


def properties_of(kind: DisplayKind, names: Iterable[str]) -> dict[str, Property]:
    """Return a kind's properties by name, including those of the links, displays and namespaces in
    `names`."""
    found = {property.name: property for property in kind.properties}
    parts = (*kind.per_link, *kind.per_display, *kind.per_namespace)
    per_part = {property.name: property for property in parts}
    for name in names:
        _, of_part, own = name.rpartition("/")
        if of_part and own in per_part:
            found[name] = per_part[own]
    return found


def _display(entry: Marked) -> Display:
    fields = entry.fields
    _require_known(entry, fields, ("kind", "name", "enabled", "properties", "source"))
    if "kind" not in fields:
        raise entry.error("a display needs a 'kind'")
    name = fields["kind"].value
    kind = BY_NAME.get(name) if isinstance(name, str) else None
    if kind is None:
        hint = did_you_mean(str(name), BY_NAME) or f"expected one of {', '.join(BY_NAME)}"
        raise fields["kind"].error(f"unknown display kind {fields['kind'].shown}: {hint}")
    values = fields.get("properties")
    source = fields["source"].value if "source" in fields else -1
    return Display(
        kind.name,
        _of_type(fields, "name", str, kind.name)[:256],
        _of_type(fields, "enabled", bool, True),
        _values(values, properties_of(kind, values.fields), f"property of {kind.name}") if values else {},
        source if isinstance(source, int) and not isinstance(source, bool) else -1,
    )


def _values(entries: Marked, known: Mapping[str, Property], what: str) -> dict[str, Value]:
    found = {}
    for name, entry in entries.fields.items():
        if name not in known:
            hint = did_you_mean(name, known) or f"expected one of {', '.join(known)}"
            raise entry.error(f"'{name}' is not a {what}: {hint}")
        try:
            found[name] = checked_value(known[name], entry.value)
        except KbotError as error:
            raise entry.error(f"'{name}' is {entry.shown}: {error}") from None
    return found


def _view(entry: Marked) -> View:
    fields = entry.fields
    _require_known(entry, fields, ("eye", "target", "flat", "follow", "frame"))
    return View(
        _triple(entry, fields.get("eye")),
        _triple(entry, fields.get("target")),
        _of_type(fields, "flat", bool, False),
        _of_type(fields, "follow", bool, True),
        _of_type(fields, "frame", str, "")[:256],
    )


def _triple(view: Marked, entry: Marked | None) -> tuple[float, float, float]:
    values = entry.plain if entry is not None else None
    if not isinstance(values, list) or len(values) != 3 or not all(_is_number(v) for v in values):
        raise (entry or view).error("a view needs an 'eye' and a 'target', each a list of three numbers")
    x, y, z = (float(v) for v in values)
    return x, y, z


def _is_number(value: object) -> bool:
    return isinstance(value, int | float) and not isinstance(value, bool) and abs(value) < 1e6


def _of_type(fields: Mapping[str, Marked], name: str, kind: type, default: Any) -> Any:  # noqa: ANN401 - a value of `kind`
    entry = fields.get(name)
    if entry is None:
        return default
    if not isinstance(entry.value, kind):
        expected = "a string" if kind is str else "true or false"
        raise entry.error(f"'{name}' is {entry.shown}: expected {expected}")
    return entry.value


def _require_known(where: Marked, fields: Mapping[str, Marked], names: tuple[str, ...]) -> None:
    for name, entry in fields.items():
        if name not in names:
            hint = did_you_mean(name, names) or f"expected one of {', '.join(names)}"
            raise entry.error(f"unknown field '{name}': {hint}")


def _is_colour(value: str) -> bool:
    return len(value) == 7 and value[0] == "#" and all(c in "0123456789abcdefABCDEF" for c in value[1:])
