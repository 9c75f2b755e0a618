"""rosbag play: plays back a recording on a bus that may have other publishers, by the bus's clock."""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterator, Mapping
from typing import Any

from kbot.messages import Bus, Clock, Publisher, TFMessage
from kbot.record.encodings.serialization import decode_cdr
from kbot.record.encodings.types import known_type
from kbot.record.entry import RecordedMessage
from kbot.record.formats import TEXT
from kbot.record.player import NOT_PLAYED
from kbot.record.reader import Recordings, TopicSummary, require_topics
from kbot.record.recorder import DESCRIPTION_TOPIC
from kbot.ros.nodes.playing import Playing
from kbot.text import DescriptionError, Diagnostic, KbotError, Severity
from kbot.tf.static_transforms import TOPIC as TF_STATIC
from kbot.tf.static_transforms import add_static_transforms

RATE = 100.0
"""Hz at which messages that are due are published."""

Publish = Callable[[Any], None]  # Any: each topic has its own type


class BusPlayback:
    """Publishes the messages of recordings when they are due, until their end or in a loop."""

    def __init__(
        self,
        bus: Bus,
        clock: Clock,
        playing: Playing,
        report: Callable[[str], None],
        *,
        excluded: Collection[str] = (),
        handlers: Mapping[str, Publish] | None = None,
        on_end: Callable[[], None] = lambda: None,
    ) -> None:
        """Start the playback.

        Args:
            bus: where messages are published.
            clock: the time of the playback.
            playing: the settings.
            report: receives sentences for the user.
            excluded: topics of the bus that already have a publisher.
            handlers: functions that receive the messages of a topic of the bus instead of the bus.
            on_end: called at the end.

        Raises:
            DescriptionError: a recording cannot be read, has no such topic, or has no message to play back.
                Its place is that of `playing`.
        """
        self._playing, self._report, self._on_end = playing, report, on_end
        try:
            topics = self._open(playing)
        except KbotError as error:
            problem = Diagnostic("L059", Severity.ERROR, str(error), playing.origin)
            raise DescriptionError([problem]) from None
        self._outputs: dict[str, tuple[Publish, type]] = {}
        for name, found in topics.items():
            self._add_output(bus, name, found, excluded, handlers or {})
        self._at = float(self._first) - playing.delay * 1e9 * playing.rate
        self._entries = self._selected()
        self._next = next(self._entries, None)
        self._step = playing.rate * 1e9 / RATE
        self._timer = clock.every(RATE, self._advance)

    def _open(self, playing: Playing) -> Mapping[str, TopicSummary]:
        """The topics of the recordings. Raises KbotError: no message can be played back."""
        self._recording = Recordings(playing.paths)
        summary, first = self._recording.summary(), playing.paths[0]
        if summary.start is None or summary.end is None:
            raise KbotError(f"{first} has no messages")
        self._first = summary.start + round(playing.start * 1e9)
        self._last = summary.end
        if playing.seconds is not None:
            self._last = min(self._last, self._first + round(playing.seconds * 1e9))
        if self._first > self._last:
            raise KbotError(
                f"{first} is {summary.seconds:g} s long: playback cannot start at {playing.start:g} s"
            )
        if playing.loop and self._first == self._last:
            raise KbotError(f"0 s of {first} cannot be played back in a loop")
        require_topics(first, summary, playing.topics)
        if summary.broken:
            self._report(f"{summary.broken}; the readable part is played back")
        return summary.topics

    def close(self) -> None:
        """Stop the playback."""
        self._timer.cancel()

    @property
    def is_over(self) -> bool:
        """Whether the playback has ended."""
        return self._timer.cancelled

    @property
    def nanoseconds(self) -> int:
        """The current time of the recording."""
        return max(0, round(self._at))

    @property
    def name(self) -> str:
        """The path of the first file."""
        return self._playing.paths[0]

    @property
    def description(self) -> str:
        """The robot's URDF; empty if the recordings have none."""
        found = (e for e in self._recording.entries() if (e.topic, e.type_name) == (DESCRIPTION_TOPIC, TEXT))
        return next((str(e.message().data) for e in found), "")

    def resume_from(self, other: BusPlayback) -> None:
        """Continue at the time of another playback of the same recording, and republish latched messages."""
        self._at = other._at
        while self._next is not None and self._next.nanoseconds <= self._at:
            if self._next.is_latched:
                self._publish(self._next)
            self._next = next(self._entries, None)
        if other.is_over:
            self._timer.cancel()

    def _add_output(
        self,
        bus: Bus,
        name: str,
        found: TopicSummary,
        excluded: Collection[str],
        handlers: Mapping[str, Publish],
    ) -> None:
        if name in NOT_PLAYED or (self._playing.topics and name not in self._playing.topics):
            return
        topic, kind = self._playing.published_name(name), known_type(found.type_name)
        if kind is None:
            self._report(f"{name} is not played back: KBot does not know the type {found.type_name}")
        elif topic in excluded:
            self._report(f"{name} is not played back: {topic} already has a publisher")
        elif topic in handlers:
            self._outputs[name] = handlers[topic], kind
        elif topic == TF_STATIC and kind is TFMessage:
            self._outputs[name] = lambda message: add_static_transforms(bus, message), kind
        else:
            try:
                publisher: Publisher[Any] = bus.advertise(topic, kind, latched=found.is_latched)
            except KbotError as error:
                self._report(f"{name} is not played back: {error}")
                return
            self._outputs[name] = publisher.publish, kind

    def _advance(self) -> None:
        self._at += self._step
        while self._next is not None and self._next.nanoseconds <= self._at:
            self._publish(self._next)
            self._next = next(self._entries, None)
        if self._next is None and self._at >= self._last:
            self._end()

    def _publish(self, entry: RecordedMessage) -> None:
        publish, kind = self._outputs[entry.topic]
        publish(decode_cdr(entry.cdr, kind))

    def _end(self) -> None:
        if self._playing.loop and self._outputs:
            self._at = float(self._first)
            self._entries = self._selected()
            self._next = next(self._entries, None)
            return
        self._timer.cancel()
        self._on_end()

    def _selected(self) -> Iterator[RecordedMessage]:
        """The messages to play back. Latched ones from before the start are included, first."""
        for entry in self._recording.entries():
            is_early = entry.is_latched and entry.nanoseconds < self._first
            if entry.topic in self._outputs and (is_early or self._first <= entry.nanoseconds <= self._last):
                yield entry
