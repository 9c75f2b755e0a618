"""The feed of a bus: passes each message to the recorder and the peers, and encodes it only once."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from functools import cache
from typing import get_origin, get_type_hints

import numpy as np

from kbot.brief import Brief, counted
from kbot.messages.bus import Bus, Subscription
from kbot.record.encodings.plain import to_json
from kbot.record.encodings.quality import offered_qos
from kbot.record.encodings.serialization import encode_cdr, encode_ros1
from kbot.record.encodings.type_names import ros_name
from kbot.record.encodings.types import ros1_definition, ros2_definition
from kbot.text import KbotError


class Packet:
    """A message on its way to recordings and peers. Its encodings are cached, so that all of them share the
    bytes."""

    __slots__ = ("_cdr", "_json", "_ros1", "is_latched", "message", "nanoseconds", "topic")

    def __init__(self, topic: str, message: object, nanoseconds: int, *, is_latched: bool = False) -> None:
        """`nanoseconds`: the publishing time by the simulation's clock. `is_latched`: whether the topic keeps
        its last message for late subscribers."""
        self.topic = topic
        self.message = message
        self.nanoseconds = nanoseconds
        self.is_latched = is_latched
        self._cdr: bytes | None = None
        self._ros1: bytes | None = None
        self._json: dict[tuple[bool, bool], str] | None = None

    @property
    def type_name(self) -> str:
        kind: type = type(self.message)
        return ros_name(kind)

    @property
    def is_large(self) -> bool:
        """Whether it carries the data of a sensor or a map. Other messages are small in comparison."""
        kind: type = type(self.message)
        return _carries_arrays(kind)

    @property
    def cdr(self) -> bytes:
        if self._cdr is None:
            self._cdr = encode_cdr(self.message)
        return self._cdr

    @property
    def ros1(self) -> bytes:
        if self._ros1 is None:
            self._ros1 = encode_ros1(self.message)
        return self._ros1

    def json(self, *, ros1: bool = False, exact: bool = False) -> str:
        """The message as JSON, as `to_json` writes it."""
        key = ros1, exact
        if self._json is None:
            self._json = {}
        if key not in self._json:
            self._json[key] = to_json(self.message, ros1=ros1, exact=exact)
        return self._json[key]

    @property
    def ros1_definition(self) -> tuple[str, str]:
        """Text and MD5."""
        return ros1_definition(self.type_name)

    @property
    def ros2_definition(self) -> tuple[str, str]:
        """Text and RIHS01 hash."""
        return ros2_definition(self.type_name)

    @property
    def offered_qos(self) -> str:
        """The publisher's quality of service, as rosbag2 records it."""
        return offered_qos(self.is_latched)


Receiver = Callable[[Packet], None]


class Feed(Brief):
    """One subscription per topic, for any number of receivers. Used only on the simulation's thread."""

    def __init__(self, bus: Bus, now: Callable[[], int]) -> None:
        """`now` returns the time in nanoseconds."""
        self._bus, self._now = bus, now
        self._receivers: dict[str, list[Receiver]] = {}
        self._subscriptions: dict[str, Subscription] = {}
        self._last: dict[str, Packet] = {}

    def offered(self) -> dict[str, type]:
        """The topics of the bus whose message types ROS has too, with their types."""
        return {name: kind for name, kind in self._bus.topics.items() if _is_known(kind)}

    def open(self, topic: str, receiver: Receiver) -> None:
        """Subscribe to an offered topic. The last message of a latched topic is received at once."""
        receivers = self._receivers.setdefault(topic, [])
        receivers.append(receiver)
        if topic not in self._subscriptions:
            kind = self._bus.require(topic)
            self._subscriptions[topic] = self._bus.subscribe(
                topic, kind, lambda m: self._hand_out(topic, m), passive=True
            )
        elif topic in self._last and self._bus.is_latched(topic):
            receiver(self._last[topic])

    def close(self, topic: str, receiver: Receiver) -> None:
        """Unsubscribe. Messages of a topic without receivers are not created at all."""
        receivers = self._receivers.get(topic, [])
        if receiver in receivers:
            receivers.remove(receiver)
        if not receivers and topic in self._subscriptions:
            self._subscriptions.pop(topic).close()
            self._last.pop(topic, None)

    def _hand_out(self, topic: str, message: object) -> None:
        packet = self._last[topic] = Packet(
            topic, message, self._now(), is_latched=self._bus.is_latched(topic)
        )
        for receiver in tuple(self._receivers[topic]):
            receiver(packet)

    def _shown(self) -> Iterator[str]:
        yield counted(len(self._subscriptions), "topic")


@cache
def _carries_arrays(kind: type) -> bool:
    return any(hint is bytes or get_origin(hint) is np.ndarray for hint in get_type_hints(kind).values())


def _is_known(kind: type) -> bool:
    try:
        ros_name(kind)
    except KbotError:
        return False
    return True
