"""Relay topics of the bus to pages, and messages of pages to the bus. Each message is encoded once."""

from __future__ import annotations

import dataclasses
import json
import struct
import time
from collections import deque
from collections.abc import Callable
from typing import Any

import numpy as np

from kbot.messages.bus import Bus, absolute
from kbot.messages.log import Log
from kbot.messages.program_topics import is_program_topic
from kbot.messages.visualization import Marker, MarkerArray, PointStamped
from kbot.record.encodings.plain import from_plain, to_plain
from kbot.record.encodings.type_names import ros_name
from kbot.record.encodings.types import known_type
from kbot.record.feed import Feed, Packet
from kbot.text import KbotError
from kbot.text.suggest import did_you_mean
from kbot.workbench.protocol import Topics, TopicView
from kbot.workbench.topics.log_tail import LogTail
from kbot.workbench.topics.marker_state import MarkerState

_ALIGNED = 8
"""Arrays in a binary frame are aligned to this many bytes, so that the page can use them in place."""


def encode_packet(packet: Packet, is_latched: bool = False, shown: object = None) -> str | bytes:
    """Encode one message of a topic: as text, or as bytes if it has array or bytes fields.

    `is_latched` means that it was published before the page subscribed. `shown` replaces its fields.
    """
    message: Any = packet.message if shown is None else shown  # Any: each topic has its own type
    fields: dict[str, Any] = {}
    arrays: dict[str, list[object]] = {}
    parts: list[bytes] = []
    at = 0
    for field in dataclasses.fields(message):
        value = getattr(message, field.name)
        if isinstance(value, bytes):
            value = np.frombuffer(value, np.uint8)
        if not isinstance(value, np.ndarray):
            fields[field.name] = to_plain(value)
            continue
        data = value.astype(value.dtype.newbyteorder("<"), copy=False).tobytes()
        arrays[field.name] = [value.dtype.name, at, value.size]
        parts.append(_padded(data, b"\0"))
        at += len(parts[-1])
    header = {
        "type": "message",
        "topic": packet.topic,
        "kind": packet.type_name,
        "time": packet.nanoseconds * 1e-9,
        "is_latched": is_latched,
        "message": fields,
    }
    if not arrays:
        return _json(header)
    text = _padded(b"    " + _json({**header, "arrays": arrays}).encode(), b" ")[4:]
    return struct.pack("<I", len(text)) + text + b"".join(parts)


def _json(value: object) -> str:
    return json.dumps(value, separators=(",", ":"), allow_nan=False)


def _padded(data: bytes, filling: bytes) -> bytes:
    return data + filling * (-len(data) % _ALIGNED)


FROM_PAGE = (
    "goal_pose",
    "move_base_simple/goal",
    "move_base/cancel",
    "initialpose",
    "clicked_point",
    "cmd_vel",
)
"""Topics that a page may publish, in any namespace."""
MOST_RATE = 30.0
"""Messages and bytes per second of one topic that are sent to pages."""
MOST_BYTES = 20e6
"""Messages and bytes a second of one topic that go to pages."""
MOST_TOPICS = 256
"""Topics that a page may subscribe to."""
COUNTED_SECONDS = 2.0
"""Seconds of simulated time over which a rate is measured."""

_EVERY_PAGE = -1
"""Page number of a subscription for all pages, including those opened later."""


Frame = str | bytes


class _Subscription:
    """A topic with subscribed pages: its newest message, and the times of the last ones."""

    def __init__(self) -> None:
        self.newest: Packet | None = None
        self.is_new = False
        self.is_latched = False
        """Whether it was published before any page subscribed."""
        self.not_before = 0.0
        """Wall-clock time before which pages receive no further message."""
        self.times: deque[int] = deque(maxlen=200)
        self.markers = MarkerState()
        self.log = LogTail()

    def receive(self, packet: Packet) -> None:
        if self.times and packet.nanoseconds < self.times[-1]:
            self.times.clear()  # time was reset
        if isinstance(packet.message, Marker | MarkerArray):
            self.markers.take(packet.message)
        elif isinstance(packet.message, Log):
            self.log.take(packet.message)
        self.newest, self.is_new, self.is_latched = packet, True, False
        self.times.append(packet.nanoseconds)

    def rate(self, now: int) -> float:
        """Return the rate in Hz of simulated time."""
        recent = [t for t in self.times if now - t <= COUNTED_SECONDS * 1e9]
        if len(recent) < 2 or recent[-1] == recent[0]:
            return 0.0
        return (len(recent) - 1) / (recent[-1] - recent[0]) * 1e9


class TopicRelay:
    """Subscribes to a topic while a page needs it, also when the bus is replaced. Only for the server's
    loop."""

    def __init__(
        self, bus: Bus, now: Callable[[], int], for_page: Callable[[object], object] = lambda message: message
    ) -> None:
        """`now` returns the time in nanoseconds. `for_page` converts a message to what pages receive."""
        self._wanted: dict[str, set[int]] = {}
        self._subscriptions: dict[str, _Subscription] = {}
        self._bus, self._now, self._for_page = bus, now, for_page
        self._feed = Feed(bus, now)
        bus.when_announced.append(self._update_subscriptions)
        self._known = -1
        """The number of the bus's changes that are processed."""
        self.counts = True
        """Whether rates are measured. Otherwise they are those of the bus, for example in a recording with
        seeks."""
        self.ended: Callable[[str], None] = lambda topic: None
        """Called with each topic that is not subscribed any more, because its messages are unknown from then
        on."""

    @property
    def bus(self) -> Bus:
        """The bus of the topics."""
        return self._bus

    def attach(self, bus: Bus) -> None:
        """Continue with another bus."""
        if bus is self._bus:
            return
        for topic in tuple(self._subscriptions):
            self._end(topic)
        for topic in self.subscribed_by(_EVERY_PAGE):
            self.unsubscribe(topic, _EVERY_PAGE)
        self._bus.when_announced.remove(self._update_subscriptions)
        self._bus, self._feed = bus, Feed(bus, self._now)
        bus.when_announced.append(self._update_subscriptions)
        self._update_subscriptions()

    def subscribe(self, topic: str, page: int) -> Frame | None:
        """Subscribe a page to a topic, which may not exist yet. Returns the latest message, if it is known.

        Raises:
            KbotError: the page subscribes to too many topics, or the name is invalid.
        """
        name = absolute(topic)
        if sum(page in pages for pages in self._wanted.values()) >= MOST_TOPICS:
            raise KbotError(f"a page can subscribe to {MOST_TOPICS} topics at most")
        self._wanted.setdefault(name, set()).add(page)
        self._update_subscriptions()
        return self.newest(name)

    def unsubscribe(self, topic: str, page: int) -> None:
        name = absolute(topic)
        pages = self._wanted.get(name, set())
        pages.discard(page)
        if not pages:
            self._wanted.pop(name, None)
            self._end(name)

    def _end(self, topic: str) -> None:
        subscription = self._subscriptions.pop(topic, None)
        if subscription is not None:
            self._feed.close(topic, subscription.receive)
            self.ended(topic)

    def subscribed_by(self, page: int) -> list[str]:
        """Return the topics that a page subscribes to."""
        return [topic for topic, pages in self._wanted.items() if page in pages]

    def newest(self, topic: str) -> Frame | None:
        """Return the latest message of a subscribed topic, or None."""
        subscription = self._subscriptions.get(topic)
        if subscription is None or subscription.newest is None:
            return None
        return self._encoded(subscription, subscription.newest, is_latched=True)

    def leave(self, page: int) -> None:
        """Unsubscribe a page that has disconnected."""
        for topic in self.subscribed_by(page):
            self.unsubscribe(topic, page)

    def news(self, *, is_last: bool = False) -> list[tuple[str, Frame, frozenset[int]]]:
        """Return topic, newest message and subscribed pages of every topic with a new message.

        A topic whose last message was sent a moment ago waits, except if these messages are the last ones.
        """
        self._update_subscriptions()
        wall, found = time.monotonic(), []
        for topic, subscription in self._subscriptions.items():
            is_due = is_last or wall >= subscription.not_before
            if subscription.is_new and subscription.newest is not None and is_due:
                frame = self._encoded(subscription, subscription.newest, subscription.is_latched)
                subscription.is_new = False
                subscription.not_before = wall + max(1.0 / MOST_RATE, len(frame) / MOST_BYTES)
                found.append((topic, frame, frozenset(self._wanted[topic])))
        return found

    def send_markers_again(self) -> None:
        """Send the current markers of each topic to its pages, because a mesh was loaded."""
        for subscription in self._subscriptions.values():
            if subscription.newest is not None and isinstance(
                subscription.newest.message, Marker | MarkerArray
            ):
                subscription.is_new = True

    def topics(self) -> Topics:
        """Return all topics that pages can subscribe to, by name."""
        inputs = self._bus.inputs
        return Topics(
            tuple(
                TopicView(name, ros_name(kind), self._rate(name), name in inputs, self._bus.is_latched(name))
                for name, kind in sorted(self._feed.offered().items())
            )
        )

    def _rate(self, topic: str) -> float | None:
        subscription = self._subscriptions.get(topic)
        if subscription is not None and self.counts:
            rate: float | None = subscription.rate(self._now())
        else:
            rate = self._bus.rate(topic) or None
        return None if rate is None else float(f"{rate:.3g}")

    def publish(self, topic: str, kind: str, message: dict[str, Any]) -> None:
        """Publish a page's message.

        Raises:
            KbotError: pages may not publish on that topic, it has no subscriber, or the message is of another
                type.
        """
        name = absolute(topic)
        if not name.endswith(tuple(f"/{allowed}" for allowed in FROM_PAGE)):
            raise KbotError(f"a page may not publish on {name}, only on {', '.join(FROM_PAGE)}")
        message_type = self._bus.topics.get(name)
        if message_type is None or not (name in self._bus.inputs or message_type is PointStamped):
            hint = did_you_mean(name, sorted(self._bus.inputs))
            raise KbotError(f"{name} has no subscriber" + (f": {hint}" if hint else ""))
        if known_type(kind) is not message_type:
            raise KbotError(f"{name} carries {ros_name(message_type)}, not {kind}")
        self._bus.publish(name, from_plain(message, message_type))

    def _encoded(self, subscription: _Subscription, packet: Packet, is_latched: bool) -> Frame:
        message = packet.message
        if isinstance(message, Log):
            return encode_packet(packet, is_latched, subscription.log.current())
        # a marker is valid until it is deleted, so none may be lost
        if isinstance(message, Marker | MarkerArray):
            message = subscription.markers.current(self._now())
        message = self._for_page(message)
        if message is not packet.message:
            packet = Packet(packet.topic, message, packet.nanoseconds)
        return encode_packet(packet, is_latched)

    def _update_subscriptions(self) -> None:
        """Subscribe to requested topics that have appeared, and unsubscribe from those that are gone."""
        if len(self._subscriptions) == len(self._wanted) and self._bus.changes == self._known:
            return
        offered = self._feed.offered()
        for topic in tuple(self._subscriptions.keys() - offered.keys()):
            self._end(topic)
        for topic in filter(is_program_topic, offered):  # kept from the first message on
            self._wanted.setdefault(topic, set()).add(_EVERY_PAGE)
        for topic in self._wanted:
            if topic in offered and topic not in self._subscriptions:
                subscription = self._subscriptions[topic] = _Subscription()
                self._feed.open(topic, subscription.receive)
                subscription.is_latched = True  # messages that arrived while it was opened are latched
        self._known = self._bus.changes
