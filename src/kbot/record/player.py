"""Plays back recordings on a bus as time passes."""

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

LATCHED = frozenset({TF_STATIC, "/map"})
NOT_SAID = frozenset({"/clock", DESCRIPTION_TOPIC, COMMANDS_TOPIC, NOTES_TOPIC, WORLD_TOPIC})
"""Said by who plays, or of no use to others."""


class Player:
    """`advance` says what is due; `bus`, `clock`, `paused` and `errands` are there for bridges."""

    def __init__(
        self,
        *paths: str,
        topics: tuple[str, ...] = (),
        left_out: tuple[str, ...] = (),
        remaps: Mapping[str, str] | None = None,
        start: float = 0.0,
        seconds: float | None = None,
    ) -> None:
        """One or more recordings as one, from `start` seconds after the first message on, for so many
        `seconds` of it, None for all. Of `topics`, empty for all, those `left_out` are not said; `remaps` has
        the names that others are said on, by those of the recording.

        Raises:
            KbotError: no such recording or topic, nothing is left of it from the start on, or two topics of
                different types would be said on one.
        """
        self._recording = Recordings(paths)
        path = self.path = self._recording.path
        self.summary: Summary = self._recording.summary()
        topics = require_topics(path, self.summary, topics)
        left_out = require_topics(path, self.summary, left_out)
        renamed = require_topics(path, self.summary, tuple(remaps or {}))
        said_on = dict(zip(renamed, map(absolute, (remaps or {}).values()), strict=True))
        if self.summary.start is None or self.summary.end is None:
            raise KbotError(f"{path} holds no messages")
        self._first = self.summary.start + round(start * 1e9)
        self._last = self.summary.end
        if self._first > self._last:
            raise KbotError(
                f"{path} is {self.summary.seconds:g} s long: nothing is left of it {start:g} s on"
            )
        if seconds is not None:
            self._last = min(self._last, self._first + round(seconds * 1e9))
        self.bus, self.clock = Bus(), Clock()
        self.errands: list[Callable[[], bool]] = []
        self.paused = False
        self.unknown: list[str] = []
        """Topics whose types KBot does not know: they are not said."""
        self._publishers: dict[str, tuple[Publisher[Any], type]] = {}  # Any: each topic has its own type
        for name, topic in self.summary.topics.items():
            kind = known_type(topic.type_name)
            if name in NOT_SAID or (topics and name not in topics) or name in left_out:
                continue
            if kind is None:
                self.unknown.append(name)
            else:
                target = said_on.get(name, name)
                self._publishers[name] = self.bus.advertise(target, kind, latched=name in LATCHED), kind
        self.rewind()

    @property
    def description(self) -> str:
        """The robot's URDF, empty where the recording has none."""
        found = (e for e in self._recording.entries() if (e.topic, e.type_name) == (DESCRIPTION_TOPIC, TEXT))
        return next((str(entry.message().data) for entry in found), "")

    @property
    def length(self) -> float:
        """Seconds of the recording that it says."""
        return (self._last - self._first) * 1e-9

    @property
    def seconds(self) -> float:
        """Where it stands, by the recording's clock."""
        return self.clock.seconds

    def run_errands(self) -> None:
        """Do what peers asked for."""
        for errand in tuple(self.errands):
            errand()

    def rewind(self) -> None:
        """Begin anew; what is latched is said at once although it came before the start."""
        self.clock.set(self._first)
        self._entries = self._wanted()
        self._next = next(self._entries, None)

    def advance(self, seconds: float) -> bool:
        """Let time pass, and say what is due in its order; whether anything is left.

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
            is_latched = entry.topic in LATCHED and entry.nanoseconds < self._first
            if entry.topic in self._publishers and (
                is_latched or self._first <= entry.nanoseconds <= self._last
            ):
                yield entry
