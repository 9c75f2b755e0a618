"""The interfaces that every format of recordings implements: writer, source, index."""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterator, Mapping
from typing import Protocol

from kbot.record.entry import RecordedMessage
from kbot.text import KbotError
from kbot.text.json_text import parse_json

NOTES_TOPIC = "/kbot/recording"
"""Where formats without metadata of their own carry it, as JSON in a String."""

TEXT = "std_msgs/msg/String"

FIRST_MOMENT = 1
"""A bag of ROS 1 takes time 0 for "no time": what happened then is told to have happened 1 ns later."""

Note = Callable[[str, dict[str, str]], None]


class Recordable(Protocol):
    """A message with its bytes in both encodings; a `Packet` of a feed, or one read from a recording."""

    @property
    def topic(self) -> str: ...
    @property
    def type_name(self) -> str: ...
    @property
    def nanoseconds(self) -> int: ...
    @property
    def cdr(self) -> bytes: ...
    @property
    def ros1(self) -> bytes: ...
    @property
    def ros1_definition(self) -> tuple[str, str]: ...
    @property
    def ros2_definition(self) -> tuple[str, str]: ...


class RecordingWriter(Protocol):
    """A recording that grows. Each method raises OSError where the disk does not take it."""

    def write(self, packet: Recordable) -> None: ...

    def annotate(self, name: str, values: dict[str, str]) -> None:
        """Put in facts of the run: robot, world, seed, versions."""
        ...

    def flush(self) -> None:
        """What was written so far is to be readable, whatever happens next."""
        ...

    def close(self) -> None:
        """Finish the file."""
        ...

    def abandon(self) -> None:
        """Let go of a file that can no longer be finished; what is whole in it stays."""
        ...


class RecordingSource(Protocol):
    """One kind of file."""

    kind: str

    def entries(self, note: Note) -> Iterator[RecordedMessage]:
        """Every message in the order it was written; `note` is told of metadata on the way.

        Raises BrokenOff where the file ends early, after all that is whole.
        """
        ...


class BrokenOff(KbotError):
    """The file ends before its end: it was not closed, or was cut short."""


class Index(Protocol):
    """A recording that is open, to be asked by time in nanoseconds of its clock."""

    start: int
    end: int
    broken: str
    """Why it ends early, where it was read without its index; else empty."""

    @property
    def topics(self) -> Mapping[str, str]:
        """Names and types, as ROS 2 writes them."""
        ...

    @property
    def counts(self) -> Mapping[str, int]:
        """How many messages each topic has; nothing of those of which the file does not say it."""
        ...

    @property
    def notes(self) -> Mapping[str, Mapping[str, str]]:
        """Facts of the run by their names, as its recorder annotated them."""
        ...

    def newest(self, topic: str, nanoseconds: int) -> RecordedMessage | None:
        """What a topic said last until a time; None where it said nothing yet. What is damaged is passed over
        where the format tells which part that is. Raises KbotError: damaged, or gone."""
        ...

    def between(self, topics: Collection[str], after: int, until: int) -> Iterator[RecordedMessage]:
        """What topics said after a time and until another, in its order; as `newest`."""
        ...

    def damage(self, nanoseconds: int) -> tuple[int, int] | None:
        """Where the part that holds a time is damaged: from when on nothing can be read, and when what
        follows begins, past the end for nothing; None where it is whole. Raises KbotError: the file is
        gone."""
        ...

    def close(self) -> None: ...


class NoIndex(KbotError):
    """The recording has no index, or one that does not put its messages in the order of time."""


def read_note(entry: RecordedMessage) -> tuple[str, dict[str, str]]:
    """The name and the facts in a message on NOTES_TOPIC. Raises KbotError: the message is none of KBot's."""
    values = {key: str(value) for key, value in read_fields(entry).items()}
    return values.pop("name", ""), values


def read_fields(entry: RecordedMessage) -> dict[str, object]:
    """What is in a message of KBot's own, as JSON in a String. Raises KbotError: it is none of KBot's."""
    try:
        found = parse_json(read_text(entry))
    except ValueError:
        found = None
    if not isinstance(found, dict):
        raise KbotError(f"{entry.place} holds nothing that KBot wrote")
    return found


def read_text(entry: RecordedMessage) -> str:
    """What is in a String. Raises KbotError: it is another message, or the bytes are none."""
    if entry.type_name != TEXT:
        raise KbotError(f"{entry.place} carries {entry.type_name}, not {TEXT}")
    return str(entry.message().data)
