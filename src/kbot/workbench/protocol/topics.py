"""Topics: which there are, what they say, and what is said on them."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Literal

from kbot.workbench.protocol.values import Name


@dataclass(frozen=True, slots=True)
class TopicView:
    """A topic by its ROS type (`sensor_msgs/msg/LaserScan`). `rate` is messages a second of simulated time,
    counted where a page hears them, otherwise by the word of who says them, or None; in a recording the mean
    of all of it. An input is what is meant to come from outside."""

    name: str
    kind: str
    rate: float | None
    is_input: bool


@dataclass(frozen=True, slots=True)
class Topics:
    """Every topic that a page may hear."""

    topics: tuple[TopicView, ...]
    type: Literal["topics"] = "topics"


@dataclass(frozen=True, slots=True)
class TopicMessage:
    """One message of a topic that was asked for, its fields by name. `time` is when it was published; with
    `is_latched` that was before it was asked for.

    Large arrays are no JSON: such a message comes as a binary frame, as `workbench.payload` says.
    """

    topic: str
    kind: str
    time: float
    is_latched: bool
    message: dict[str, Any]
    type: Literal["message"] = "message"


@dataclass(frozen=True, slots=True)
class Subscribe:
    """Hear a topic: the newest message whenever there is one and this page keeps up."""

    topic: Name
    type: Literal["subscribe"] = "subscribe"


@dataclass(frozen=True, slots=True)
class Unsubscribe:
    topic: Name
    type: Literal["unsubscribe"] = "unsubscribe"


@dataclass(frozen=True, slots=True)
class Publish:
    """Say something on a topic that is meant for it: a goal, a pose, a point, a command."""

    topic: Name
    kind: Name
    message: dict[str, Any]
    type: Literal["publish"] = "publish"
