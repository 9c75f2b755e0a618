"""What can be set of a display, and what a display is: the table in `kinds` is made of these."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal, TypeAlias

Value: TypeAlias = bool | float | str
ValueKind = Literal["switch", "number", "colour", "choice", "text", "topic", "frame"]


@dataclass(frozen=True, slots=True)
class Property:
    """`initial` is the value of a new display. Numbers lie from `low` to `high`, `unit` is shown beside them;
    a colour is `#rrggbb`; a choice is one of `options`. A topic that is empty is the first of the display's
    type, a frame that is empty the fixed frame. `rviz` is the name in rviz's files, where it has one; a part
    after a slash lies beneath the part before. Those of a `group` are shown together."""

    name: str
    label: str
    kind: ValueKind
    initial: Value
    low: float = 0.0
    high: float = 1e6
    unit: str = ""
    options: tuple[str, ...] = ()
    group: str = ""
    rviz: str = ""


@dataclass(frozen=True, slots=True)
class DisplayKind:
    """`topic` is the type of the messages it shows, empty where it shows none; of a `single` kind there is
    one display at most. `rviz` is the class's name without its package."""

    name: str
    about: str
    properties: tuple[Property, ...]
    topic: str = ""
    single: bool = False
    rviz: str = ""


def switch(name: str, label: str, initial: bool, rviz: str = "", group: str = "") -> Property:
    return Property(name, label, "switch", initial, rviz=rviz, group=group)


def number(
    name: str,
    label: str,
    initial: float,
    low: float,
    high: float,
    unit: str = "",
    rviz: str = "",
    group: str = "",
) -> Property:
    return Property(name, label, "number", initial, low, high, unit, rviz=rviz, group=group)


def colour(name: str, label: str, initial: str, rviz: str = "", group: str = "") -> Property:
    return Property(name, label, "colour", initial, rviz=rviz, group=group)


def choice(name: str, label: str, options: tuple[str, ...], rviz: str = "", group: str = "") -> Property:
    """The first of the options is the initial one."""
    return Property(name, label, "choice", options[0], options=options, rviz=rviz, group=group)


def text(name: str, label: str, rviz: str = "", group: str = "") -> Property:
    return Property(name, label, "text", "", rviz=rviz, group=group)


TOPIC = Property("topic", "Topic", "topic", "", rviz="Topic")
OPACITY = number("alpha", "Opacity", 1.0, 0.0, 1.0, rviz="Alpha")
