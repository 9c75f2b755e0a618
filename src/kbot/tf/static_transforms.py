"""static_transform_publisher: publishes fixed transforms between frames."""

from __future__ import annotations

import json
from collections.abc import Iterable
from dataclasses import asdict, dataclass

from kbot.messages import types as msg
from kbot.messages.bus import Bus
from kbot.messages.clock import Clock
from kbot.text.json_text import parse_json


@dataclass(frozen=True, slots=True)
class StaticTransform:
    """`parent_from_child`: a translation in m, and a quaternion x, y, z, w."""

    parent: str
    child: str
    xyz: tuple[float, float, float]
    xyzw: tuple[float, float, float, float]


def to_json(transforms: Iterable[StaticTransform]) -> str:
    """The form in which a recording stores them."""
    return json.dumps([asdict(transform) for transform in transforms])


def from_json(text: str) -> list[StaticTransform]:
    """Parse the text of `to_json`. Raises LookupError, TypeError or ValueError: it is another text."""
    return [
        StaticTransform(t["parent"], t["child"], tuple(t["xyz"]), tuple(t["xyzw"])) for t in parse_json(text)
    ]


TOPIC = "/tf_static"


def publish_static_transforms(bus: Bus, clock: Clock, transforms: Iterable[StaticTransform]) -> None:
    """Publish the transforms on /tf_static, with the current time."""
    header = msg.Header(clock.stamp)
    stamped = [
        msg.TransformStamped(
            msg.Header(header.stamp, t.parent),
            t.child,
            msg.Transform(msg.Vector3(*t.xyz), msg.Quaternion(*t.xyzw)),
        )
        for t in transforms
    ]
    add_static_transforms(bus, msg.TFMessage(tuple(stamped)))


def add_static_transforms(bus: Bus, message: msg.TFMessage) -> None:
    """Publish transforms on /tf_static, together with those published before.

    A latched topic keeps only its last message, so that message must have all transforms.
    """
    before: list[msg.TransformStamped] = []
    publisher = bus.advertise(TOPIC, msg.TFMessage, latched=True)
    bus.subscribe(TOPIC, msg.TFMessage, lambda message: before.extend(message.transforms)).close()
    children = {t.child_frame_id for t in message.transforms}
    kept = tuple(t for t in before if t.child_frame_id not in children)
    publisher.publish(msg.TFMessage(kept + message.transforms))
