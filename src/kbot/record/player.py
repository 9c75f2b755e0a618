"""Plays back recordings: publishes their messages on a bus as time advances."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from typing import Any

from kbot.messages import Bus, Clock, Publisher, TFMessage
from kbot.messages.bus import absolute
from kbot.record.encodings.serialization import decode_cdr
from kbot.record.encodings.types import known_type
from kbot.record.entry import RecordedMessage
from kbot.record.formats import NOTES_TOPIC, TEXT
from kbot.record.reader import Recordings, Summary, require_topics
from kbot.record.recorder import COMMANDS_TOPIC, DESCRIPTION_TOPIC
from kbot.record.world_recorder import WORLD_TOPIC
from kbot.text import KbotError
from kbot.tf.static_transforms import TOPIC as TF_STATIC
from kbot.tf.static_transforms import add_static_transforms

NOT_PLAYED = frozenset({"/clock", DESCRIPTION_TOPIC, COMMANDS_TOPIC, NOTES_TOPIC, WORLD_TOPIC})
"""Topics that the caller publishes itself, or that only KBot reads."""


class Player:
    """Plays back recordings. `advance` publishes the due messages. Bridges use `bus`, `clock`, `paused` and
    `errands`."""

    def __init__(
        self,
        *paths: str,
        topics: tuple[str, ...] = (),
        left_out: tuple[str, ...] = (),
        remaps: Mapping[str, str] | None = None,
        start: float = 0.0,
        seconds: float | None = None,
    ) -> None:
        """Open one or more recordings, merged by time.

        The playback begins `start` seconds after the first message and takes `seconds` of the recording, None
        for all. It includes `topics`, or all if empty, but not those in `left_out`. `remaps` gives new names
        by recorded names.

        Raises:
            KbotError: a recording or topic does not exist, the start is after the last message, or two
                topics of different types would get the same name.
        """
        self._recording = Recordings(paths)
        path = self.path = self._recording.path
        self.summary: Summary = self._recording.summary()
        topics = require_topics(path, self.summary, topics)
        left_out = require_topics(path, self.summary, left_out)
        renamed = require_topics(path, self.summary, tuple(remaps or {}))
        new_names = dict(zip(renamed, map(absolute, (remaps or {}).values()), strict=True))
        if self.summary.start is None or self.summary.end is None:
            raise KbotError(f"{path} has no messages")
        self._first = self.summary.start + round(start * 1e9)
        self._last = self.summary.end
        if self._first > self._last:
            raise KbotError(
                f"{path} is {self.summary.seconds:g} s long: playback cannot start at {start:g} s"
            )
        if seconds is not None:
            self._last = min(self._last, self._first + round(seconds * 1e9))
        self.bus, self.clock = Bus(), Clock()
        self.errands: list[Callable[[], bool]] = []
        self.paused = False
        self.unknown: list[str] = []
        """Topics whose types KBot does not know. They are not published."""
        self._publishers: dict[str, tuple[Publisher[Any], type]] = {}  # Any: each topic has its own type
        for name, topic in self.summary.topics.items():
            kind = known_type(topic.type_name)
            if name in NOT_PLAYED or (topics and name not in topics) or name in left_out:
                continue
            if kind is None:
                self.unknown.append(name)
            else:
                target = new_names.get(name, name)
                self._publishers[name] = self.bus.advertise(target, kind, latched=topic.is_latched), kind
        self.rewind()

    @property
    def description(self) -> str:
        """The robot's URDF, empty if the recording has none."""
        found = (e for e in self._recording.entries() if (e.topic, e.type_name) == (DESCRIPTION_TOPIC, TEXT))
        return next((str(entry.message().data) for entry in found), "")

    @property
    def length(self) -> float:
        """Length of the playback in seconds of the recording."""
        return (self._last - self._first) * 1e-9

    @property
    def seconds(self) -> float:
        """The current time by the recording's clock."""
        return self.clock.seconds

    def run_errands(self) -> None:
        """Run the functions that bridges queued."""
        for errand in tuple(self.errands):
            errand()

    def rewind(self) -> None:
        """Start again. Latched messages from before the start are published first."""
        self.clock.set(self._first)
        self._entries = self._wanted()
        self._next = next(self._entries, None)

    def advance(self, seconds: float) -> bool:
        """Advance the clock and publish the due messages in order. Returns whether any time is left.

        Raises:
            KbotError: a message cannot be read.
        """
        until = min(self.clock.nanoseconds + round(seconds * 1e9), self._last)
        while self._next is not None and self._next.nanoseconds <= until:
            entry = self._next
            if entry.nanoseconds > self.clock.nanoseconds:
                self.clock.advance_to(entry.nanoseconds)
            publisher, kind = self._publishers[entry.topic]
            if publisher.topic == TF_STATIC and kind is TFMessage:
                add_static_transforms(self.bus, decode_cdr(entry.cdr, TFMessage))
            elif publisher.has_subscribers:
                publisher.publish(decode_cdr(entry.cdr, kind))
            self._next = next(self._entries, None)
        self.clock.advance_to(until)
        return self._next is not None and until < self._last

    def _wanted(self) -> Iterator[RecordedMessage]:
        for entry in self._recording.entries():
            is_early = entry.is_latched and entry.nanoseconds < self._first
            if entry.topic in self._publishers and (
                is_early or self._first <= entry.nanoseconds <= self._last
            ):
                yield entry
