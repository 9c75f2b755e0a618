"""static_transform_publisher: frames that stand still to each other, said once for all."""

from __future__ import annotations

from collections.abc import Iterable

from kbot.launch.nodes.static_transforms import StaticTransform
from kbot.messages import types as msg
from kbot.messages.bus import Bus
from kbot.messages.clock import Clock

TOPIC = "/tf_static"


def publish_static_transforms(bus: Bus, clock: Clock, transforms: Iterable[StaticTransform]) -> None:
    """Say them on /tf_static."""
    header = msg.Header(clock.stamp)
    said = [
        msg.TransformStamped(
            msg.Header(header.stamp, t.parent),
            t.child,
            msg.Transform(msg.Vector3(*t.xyz), msg.Quaternion(*t.xyzw)),
        )
        for t in transforms
    ]
    say_static(bus, msg.TFMessage(tuple(said)))


def say_static(bus: Bus, message: msg.TFMessage) -> None:
    """Say transforms on /tf_static together with what was said there before: a latched topic keeps one
    message."""
    before: list[msg.TransformStamped] = []
    publisher = bus.advertise(TOPIC, msg.TFMessage, latched=True)
    bus.subscribe(TOPIC, msg.TFMessage, lambda message: before.extend(message.transforms)).close()
    children = {t.child_frame_id for t in message.transforms}
    kept = tuple(t for t in before if t.child_frame_id not in children)
    publisher.publish(msg.TFMessage(kept + message.transforms))
