"""The types of the table of displays: a display kind and its properties."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal, TypeAlias

Value: TypeAlias = bool | float | str
ValueKind = Literal["switch", "number", "colour", "choice", "text", "topic", "frame"]


@dataclass(frozen=True, slots=True)
class Property:
    """`initial` is the value of a new display. Numbers lie from `low` to `high`, `unit` is shown beside them,
    and `zero` in the place of a 0 that stands for something; a colour is `#rrggbb`; a choice is one of
    `options`. A topic that is empty is the first of the display's type, a frame that is empty the fixed
    frame. `rviz` is the name in rviz's files, where it has one; a part after a slash lies beneath the part
    before."""

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
    """`topics` are the types of messages it shows; of a `single` kind there is one display at most. Each link
    of the robot has the properties `per_link` too, as `link/property`, each display `per_display` and each
    namespace of markers `per_namespace`, as `name/property`. `rviz` are the names that rviz has for its
    class, without the package, the first being that which is written."""

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
    """The first of the options is the initial one."""
    return Property(name, label, "choice", options[0], options=options, rviz=rviz)


def text(name: str, label: str, rviz: str = "") -> Property:
    return Property(name, label, "text", "", rviz=rviz)


def frame(name: str, label: str, rviz: str = "") -> Property:
    return Property(name, label, "frame", "", rviz=rviz)


def opacity(initial: float = 1.0, rviz: str = "Alpha") -> Property:
    return number("alpha", "Opacity", initial, 0.0, 1.0, rviz=rviz)


TOPIC = Property("topic", "Topic", "topic", "", rviz="Topic")
