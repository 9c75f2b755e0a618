"""rosbag play: plays back a recording on a bus with other publishers, by the bus's clock."""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterator, Mapping
from typing import Any

from kbot.messages import Bus, Clock, Publisher, TFMessage
from kbot.record.encodings.serialization import decode_cdr
from kbot.record.encodings.types import known_type
from kbot.record.entry import RecordedMessage
from kbot.record.formats import TEXT
from kbot.record.player import LATCHED, NOT_SAID
from kbot.record.reader import Recordings, require_topics
from kbot.record.recorder import DESCRIPTION_TOPIC
from kbot.ros.nodes.playing import Playing
from kbot.text import DescriptionError, Diagnostic, KbotError, Severity
from kbot.tf.static_transforms import TOPIC as TF_STATIC
from kbot.tf.static_transforms import say_static

RATE = 100.0
"""Hz at which it looks what is due."""

Say = Callable[[Any], None]  # Any: each topic has its own type


class BusPlayback:
    """Says what is due until the end, or for good where it loops."""

    def __init__(
        self,
        bus: Bus,
        clock: Clock,
        playing: Playing,
        tell: Callable[[str], None],
        *,
        theirs: Collection[str] = (),
        instead: Mapping[str, Say] | None = None,
        on_end: Callable[[], None] = lambda: None,
    ) -> None:
        """`tell` is given sentences for the user. Topics that are `theirs` are left to those who speak on
        them; what is said on those of `instead` is handed on there.

        Raises:
            DescriptionError: at the player's place, a recording cannot be read, has no such topic, or holds
                nothing from the start on.
        """
        self._playing, self._tell, self._on_end = playing, tell, on_end
        try:
            types = self._open(playing)
        except KbotError as error:
            found = Diagnostic("L059", Severity.ERROR, str(error), playing.origin)
            raise DescriptionError([found]) from None
        self._say: dict[str, tuple[Say, type]] = {}
        for name, type_name in types.items():
            self._offer(bus, name, type_name, theirs, instead or {})
        self._at = float(self._first) - playing.delay * 1e9 * playing.rate
        self._entries = self._wanted()
        self._next = next(self._entries, None)
        self._step = playing.rate * 1e9 / RATE
        self._timer = clock.every(RATE, self._advance)

    def _open(self, playing: Playing) -> Mapping[str, str]:
        """The topics of the recordings, with their types. Raises KbotError: they hold nothing to say."""
        self._recording = Recordings(playing.paths)
        summary, first = self._recording.summary(), playing.paths[0]
        if summary.start is None or summary.end is None:
            raise KbotError(f"{first} holds no messages")
        self._first = summary.start + round(playing.start * 1e9)
        self._last = summary.end
        if playing.seconds is not None:
            self._last = min(self._last, self._first + round(playing.seconds * 1e9))
        if self._first > self._last:
            raise KbotError(
                f"{first} is {summary.seconds:g} s long: nothing is left of it {playing.start:g} s on"
            )
        if playing.loop and self._first == self._last:
            raise KbotError(f"0 s of {first} would be said: that leaves nothing to be said again and again")
        require_topics(first, summary, playing.topics)
        if summary.broken:
            self._tell(f"{summary.broken}; what can be read is played")
        return {name: topic.type_name for name, topic in summary.topics.items()}

    def close(self) -> None:
        """Say no more."""
        self._timer.cancel()

    @property
    def is_over(self) -> bool:
        """Whether nothing is left to say."""
        return self._timer.cancelled

    @property
    def nanoseconds(self) -> int:
        """Where it stands, by the recording's clock."""
        return max(0, round(self._at))

    @property
    def name(self) -> str:
        """That of its first file."""
        return self._playing.paths[0]

    @property
    def description(self) -> str:
        """The robot's URDF, empty where the recordings have none."""
        found = (e for e in self._recording.entries() if (e.topic, e.type_name) == (DESCRIPTION_TOPIC, TEXT))
        return next((str(e.message().data) for e in found), "")

    def go_on_from(self, other: BusPlayback) -> None:
        """Stand where another of the same recording does; what is latched is said again."""
        self._at = other._at
        while self._next is not None and self._next.nanoseconds <= self._at:
            if self._next.topic in LATCHED:
                self._speak(self._next)
            self._next = next(self._entries, None)
        if other.is_over:
            self._timer.cancel()

    def _offer(
        self, bus: Bus, name: str, type_name: str, theirs: Collection[str], instead: Mapping[str, Say]
    ) -> None:
        if name in NOT_SAID or (self._playing.topics and name not in self._playing.topics):
            return
        topic, kind = self._playing.said_on(name), known_type(type_name)
        if kind is None:
            self._tell(f"{name} is not said: KBot does not know {type_name}")
        elif topic in theirs:
            self._tell(f"{name} of the recording is left out: {topic} is said here already")
        elif topic in instead:
            self._say[name] = instead[topic], kind
        elif topic == TF_STATIC and kind is TFMessage:
            self._say[name] = lambda message: say_static(bus, message), kind
        else:
            try:
                publisher: Publisher[Any] = bus.advertise(topic, kind, latched=topic in LATCHED)
            except KbotError as error:
                self._tell(f"{name} of the recording is left out: {error}")
                return
            self._say[name] = publisher.publish, kind

    def _advance(self) -> None:
        self._at += self._step
        while self._next is not None and self._next.nanoseconds <= self._at:
            self._speak(self._next)
            self._next = next(self._entries, None)
        if self._next is None and self._at >= self._last:
            self._end()

    def _speak(self, entry: RecordedMessage) -> None:
        say, kind = self._say[entry.topic]
        say(decode_cdr(entry.cdr, kind))

    def _end(self) -> None:
        if self._playing.loop and self._say:
            self._at = float(self._first)
            self._entries = self._wanted()
            self._next = next(self._entries, None)
            return
        self._timer.cancel()
        self._on_end()

    def _wanted(self) -> Iterator[RecordedMessage]:
        for entry in self._recording.entries():
            is_early = entry.topic in LATCHED and entry.nanoseconds < self._first
            if entry.topic in self._say and (is_early or self._first <= entry.nanoseconds <= self._last):
                yield entry
