"""Relays topics of the bus to pages, and messages of pages to the bus. Each message is encoded once."""

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
from kbot.messages.visualization import Marker, MarkerArray, PointStamped
from kbot.record.encodings.plain import from_plain, to_plain
from kbot.record.encodings.type_names import ros_name
from kbot.record.encodings.types import known_type
from kbot.record.feed import Feed, Packet
from kbot.text import KbotError
from kbot.text.suggest import did_you_mean
from kbot.workbench.protocol import Topics, TopicView
from kbot.workbench.topics.marker_state import MarkerState

_ALIGNED = 8


def encode_packet(packet: Packet, is_latched: bool = False) -> str | bytes:
    """One message of a topic, said before it was asked for where it `is_latched`: text, or bytes where fields
    of it are arrays or bytes."""
    message: Any = packet.message  # Any: each topic has its own type
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
"""What a page may speak on, in any namespace."""
MOST_RATE = 30.0
MOST_BYTES = 20e6
"""Messages and bytes a second of one topic that go to pages."""
MOST_TOPICS = 256
"""Topics that a page may wait for."""
COUNTED_SECONDS = 2.0
"""Seconds of simulated time over which a rate is counted."""

Frame = str | bytes


class _Heard:
    """A topic that somebody hears: its newest message, and when the last ones came."""

    def __init__(self) -> None:
        self.newest: Packet | None = None
        self.is_new = False
        self.is_latched = False
        """Whether it was said before anybody heard the topic."""
        self.not_before = 0.0
        """Wall time before which pages get no further message."""
        self.times: deque[int] = deque(maxlen=200)
        self.markers = MarkerState()

    def receive(self, packet: Packet) -> None:
        if self.times and packet.nanoseconds < self.times[-1]:
            self.times.clear()  # time began anew
        if isinstance(packet.message, Marker | MarkerArray):
            self.markers.take(packet.message)
        self.newest, self.is_new, self.is_latched = packet, True, False
        self.times.append(packet.nanoseconds)

    def rate(self, now: int) -> float:
        """Hz of simulated time."""
        recent = [t for t in self.times if now - t <= COUNTED_SECONDS * 1e9]
        if len(recent) < 2 or recent[-1] == recent[0]:
            return 0.0
        return (len(recent) - 1) / (recent[-1] - recent[0]) * 1e9


class TopicRelay:
    """Hears a topic while a page wants it, wherever the bus comes and goes. For the server's loop alone."""

    def __init__(
        self, bus: Bus, now: Callable[[], int], for_page: Callable[[object], object] = lambda message: message
    ) -> None:
        """`now` tells the time in nanoseconds; `for_page` makes of a message what pages are sent."""
        self._wanted: dict[str, set[int]] = {}
        self._heard: dict[str, _Heard] = {}
        self._bus, self._now, self._for_page = bus, now, for_page
        self._feed = Feed(bus, now)
        self._known = -1
        """How much of the bus's changes was looked at."""
        self.counts = True
        """Whether what is heard is counted; otherwise rates are what the bus says, as in a recording that is
        gone about in."""
        self.ended: Callable[[str], None] = lambda topic: None
        """Told of each topic that is not heard any more, of which nobody knows what it says."""

    @property
    def bus(self) -> Bus:
        """Where the topics are."""
        return self._bus

    def attach(self, bus: Bus) -> None:
        """Go on with another bus."""
        if bus is self._bus:
            return
        for topic in tuple(self._heard):
            self._end(topic)
        self._bus, self._feed = bus, Feed(bus, self._now)
        self._listen()

    def subscribe(self, topic: str, page: int) -> Frame | None:
        """Let a page hear a topic, also one that is not there yet; what it said last, if it is known.

        Raises:
            KbotError: the page hears very many topics, or the name is none.
        """
        name = absolute(topic)
        if sum(page in pages for pages in self._wanted.values()) >= MOST_TOPICS:
            raise KbotError(f"a page may hear {MOST_TOPICS} topics at once")
        self._wanted.setdefault(name, set()).add(page)
        self._listen()
        return self.newest(name)

    def unsubscribe(self, topic: str, page: int) -> None:
        name = absolute(topic)
        pages = self._wanted.get(name, set())
        pages.discard(page)
        if not pages:
            self._wanted.pop(name, None)
            self._end(name)

    def _end(self, topic: str) -> None:
        heard = self._heard.pop(topic, None)
        if heard is not None:
            self._feed.close(topic, heard.receive)
            self.ended(topic)

    def heard_by(self, page: int) -> list[str]:
        """The topics that a page wants."""
        return [topic for topic, pages in self._wanted.items() if page in pages]

    def newest(self, topic: str) -> Frame | None:
        """What a topic that is heard said last, if it did."""
        heard = self._heard.get(topic)
        if heard is None or heard.newest is None:
            return None
        return self._encoded(heard, heard.newest, is_latched=True)

    def leave(self, page: int) -> None:
        """The page is gone."""
        for topic in self.heard_by(page):
            self.unsubscribe(topic, page)

    def news(self) -> list[tuple[str, Frame, frozenset[int]]]:
        """Topic, its newest message and the pages that hear it, of every topic that said something."""
        self._listen()
        wall, found = time.monotonic(), []
        for topic, heard in self._heard.items():
            if heard.is_new and heard.newest is not None and wall >= heard.not_before:
                frame = self._encoded(heard, heard.newest, heard.is_latched)
                heard.is_new = False
                heard.not_before = wall + max(1.0 / MOST_RATE, len(frame) / MOST_BYTES)
                found.append((topic, frame, frozenset(self._wanted[topic])))
        return found

    def topics(self) -> Topics:
        """What there is to hear, by name."""
        inputs = self._bus.inputs
        return Topics(
            tuple(
                TopicView(name, ros_name(kind), self._rate(name), name in inputs)
                for name, kind in sorted(self._feed.offered().items())
            )
        )

    def _rate(self, topic: str) -> float | None:
        heard = self._heard.get(topic)
        if heard is not None and self.counts:
            rate: float | None = heard.rate(self._now())
        else:
            rate = self._bus.rate(topic) or None
        return None if rate is None else float(f"{rate:.3g}")

    def publish(self, topic: str, kind: str, message: dict[str, Any]) -> None:
        """Say what a page says.

        Raises:
            KbotError: pages may not speak on that topic, nobody hears it, or it is not of the topic's type.
        """
        name = absolute(topic)
        if not name.endswith(tuple(f"/{allowed}" for allowed in FROM_PAGE)):
            raise KbotError(f"a page may not speak on {name}: it may on {', '.join(FROM_PAGE)}")
        message_type = self._bus.topics.get(name)
        if message_type is None or not (name in self._bus.inputs or message_type is PointStamped):
            hint = did_you_mean(name, sorted(self._bus.inputs))
            raise KbotError(f"nobody hears {name}" + (f": {hint}" if hint else ""))
        if known_type(kind) is not message_type:
            raise KbotError(f"{name} carries {ros_name(message_type)}, not {kind}")
        self._bus.publish(name, from_plain(message, message_type))

    def _encoded(self, heard: _Heard, packet: Packet, is_latched: bool) -> Frame:
        message = packet.message
        if isinstance(message, Marker | MarkerArray):  # a marker stands until it is deleted: none is lost
            message = heard.markers.standing(self._now())
        message = self._for_page(message)
        if message is not packet.message:
            packet = Packet(packet.topic, message, packet.nanoseconds)
        return encode_packet(packet, is_latched)

    def _listen(self) -> None:
        """Hear what is wanted and has come up, and no more what is gone."""
        if len(self._heard) == len(self._wanted) and self._bus.changes == self._known:
            return
        offered = self._feed.offered()
        for topic in tuple(self._heard.keys() - offered.keys()):
            self._end(topic)
        for topic in self._wanted:
            if topic in offered and topic not in self._heard:
                heard = self._heard[topic] = _Heard()
                self._feed.open(topic, heard.receive)
                heard.is_latched = True  # what it said while it was opened
        self._known = self._bus.changes
