"""What a display of rviz sets for each link of the robot, each other display or each namespace."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

from kbot.workbench.displays.marked_yaml import Marked
from kbot.workbench.displays.property import DisplayKind, Value


def read_links(kind: DisplayKind, links: Marked | None) -> dict[str, Value]:
    """What `Links` says other than at first, as `link/property`."""
    found: dict[str, Value] = {}
    for link, entry in links.value.items() if links is not None and isinstance(links.value, dict) else ():
        for property in kind.per_link if isinstance(entry.value, dict) else ():
            value = entry.value.get(property.rviz)
            if value is not None and value.value != property.initial:
                found[f"{link}/{property.name}"] = value.value
    return found


def hidden(visibility: object, above: bool = True) -> Iterator[str]:
    """Names of the displays that a camera's `Visibility` leaves out, alone or with their group."""
    if not isinstance(visibility, dict):
        return
    is_seen = above and visibility.get("Value") is not False
    for name, value in visibility.items():
        if isinstance(value, dict):
            yield from hidden(value, is_seen)
        elif name != "Value" and not (is_seen and value is not False):
            yield str(name)


def show(camera: dict[str, Any], name: str, is_seen: bool) -> None:
    """Say in a camera's `Visibility` whether a display is seen, where that is told already or at the end."""
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
    """What `Namespaces` hides, as `namespace/show`."""
    said = namespaces.items() if isinstance(namespaces, dict) else ()
    return {f"{name}/show": False for name, is_seen in said if is_seen is False}


def show_namespace(markers: dict[str, Any], name: str, is_seen: bool) -> None:
    """Say in a display's `Namespaces` whether the markers of one are seen."""
    namespaces = markers.get("Namespaces")
    if not isinstance(namespaces, dict):
        namespaces = markers["Namespaces"] = {}
    namespaces[name] = is_seen
