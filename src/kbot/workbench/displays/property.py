"""The types of the table of displays: a display kind and its properties."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal, TypeAlias

Value: TypeAlias = bool | float | str
ValueKind = Literal["switch", "number", "colour", "choice", "text", "topic", "frame"]


@dataclass(frozen=True, slots=True)
class Property:
    """A property of a display.

    `initial` is the value in a new display. Numbers are from `low` to `high`, with `unit` shown beside them,
    and `zero` is shown instead of 0 if 0 has a special meaning. A colour is `#rrggbb`, a choice is one of
    `options`. An empty topic is the first one of the display's type, an empty frame is the fixed frame.
    `rviz` is the label in rviz files, or empty. `A/B` is the label `B` under `A`.
    """

    name: str
    label: str
    kind: ValueKind
    initial: Value
    low: float = 0.0
    high: float = 1e6
    unit: str = ""
    zero: str = ""
    options: tuple[str, ...] = ()
    rviz: str = ""


@dataclass(frozen=True, slots=True)
class DisplayKind:
    """A kind of display.

    `topics` are the message types that it displays. A `single` kind has at most one display. Each link of the
    robot also has the properties `per_link`, as `link/property`. Each display has `per_display` and each
    marker namespace `per_namespace`, as `name/property`. `rviz` are rviz's names of the class, without the
    package. The first one is written.
    """

    name: str
    about: str
    properties: tuple[Property, ...]
    topics: tuple[str, ...] = ()
    single: bool = False
    per_link: tuple[Property, ...] = ()
    per_display: tuple[Property, ...] = ()
    per_namespace: tuple[Property, ...] = ()
    rviz: tuple[str, ...] = ()


def switch(name: str, label: str, initial: bool, rviz: str = "") -> Property:
    return Property(name, label, "switch", initial, rviz=rviz)


def number(
    name: str,
    label: str,
    initial: float,
    low: float,
    high: float,
    unit: str = "",
    rviz: str = "",
    zero: str = "",
) -> Property:
    return Property(name, label, "number", initial, low, high, unit, zero, rviz=rviz)


def colour(name: str, label: str, initial: str, rviz: str = "") -> Property:
    return Property(name, label, "colour", initial, rviz=rviz)


def choice(name: str, label: str, options: tuple[str, ...], rviz: str = "") -> Property:
    """Return a choice whose initial value is the first option."""
    return Property(name, label, "choice", options[0], options=options, rviz=rviz)


def text(name: str, label: str, rviz: str = "") -> Property:
    return Property(name, label, "text", "", rviz=rviz)


def frame(name: str, label: str, rviz: str = "") -> Property:
    return Property(name, label, "frame", "", rviz=rviz)


def opacity(initial: float = 1.0, rviz: str = "Alpha") -> Property:
    return number("alpha", "Opacity", initial, 0.0, 1.0, rviz=rviz)


TOPIC = Property("topic", "Topic", "topic", "", rviz="Topic")
