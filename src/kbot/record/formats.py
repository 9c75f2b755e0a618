"""The interfaces that each recording format implements: writer, source, index."""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterator, Mapping
from typing import Protocol

from kbot.record.encodings.quality import NOTES_TOPIC as NOTES_TOPIC
from kbot.record.entry import RecordedMessage
from kbot.text import KbotError
from kbot.text.json_text import parse_json

TEXT = "std_msgs/msg/String"

FIRST_TIME = 1
"""Nanoseconds. A ROS 1 bag treats time 0 as "no time", so messages at 0 are written with 1 ns."""

INDEX_BYTES = 256 * 1024
"""Bytes of a recording's index that a writer keeps in memory. The index grows by 2 MB an hour. The rest is
in a temporary file until the recording is closed."""

Note = Callable[[str, dict[str, str]], None]


class Recordable(Protocol):
    """A message with its bytes in both encodings: a `Packet` of a feed, or a `RecordedMessage`."""

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
    @property
    def is_latched(self) -> bool: ...
    @property
    def offered_qos(self) -> str: ...


class RecordingWriter(Protocol):
    """Writes a recording. Each method raises OSError if the disk is full or removed."""

    def write(self, packet: Recordable) -> None: ...

    def annotate(self, name: str, values: dict[str, str]) -> None:
        """Write metadata of the run: robot, world, seed, versions."""
        ...

    def flush(self) -> None:
        """Make everything written so far readable, even after a crash."""
        ...

    def close(self) -> None:
        """Finish the file."""
        ...

    def abandon(self) -> None:
        """Close a file that can no longer be finished. Its complete parts remain."""
        ...


class RecordingSource(Protocol):
    """Reads one format of files."""

    kind: str

    def entries(self, note: Note) -> Iterator[RecordedMessage]:
        """Every message in the order it was written. `note` is called with each metadata record.

        Raises:
            BrokenOff: the file is incomplete. Raised after all readable messages.
        """
        ...


class BrokenOff(KbotError):
    """The file is incomplete: it was not closed, or it was truncated."""


class Index(Protocol):
    """An open recording with access by time, in nanoseconds of its clock."""

    start: int
    end: int
    broken: str
    """Why it is incomplete, if it was read without its index; else empty."""

    @property
    def topics(self) -> Mapping[str, str]:
        """Types by topic, as ROS 2 writes them."""
        ...

    @property
    def counts(self) -> Mapping[str, int]:
        """Number of messages by topic. Topics for which the file has no number are left out."""
        ...

    @property
    def latched(self) -> Collection[str]:
        """The topics that kept their last message for late subscribers."""
        ...

    @property
    def notes(self) -> Mapping[str, Mapping[str, str]]:
        """The metadata records of the run by name."""
        ...

    def newest(self, topic: str, nanoseconds: int) -> RecordedMessage | None:
        """The last message of a topic until a time, None if there is none yet.

        Damaged parts are skipped if the format shows which parts they are.

        Raises:
            KbotError: the file is damaged or was removed.
        """
        ...

    def between(self, topics: Collection[str], after: int, until: int) -> Iterator[RecordedMessage]:
        """The messages of topics after one time and until another, sorted by time. Raises like `newest`."""
        ...

    def damage(self, nanoseconds: int) -> tuple[int, int] | None:
        """The time range of the damage around a time, None if that part is readable.

        The range ends where the next readable part begins, or after the end of the recording.

        Raises:
            KbotError: the file was removed.
        """
        ...

    def close(self) -> None: ...


class NoIndex(KbotError):
    """The recording has no index, or one that does not sort its messages by time."""


def read_note(entry: RecordedMessage) -> tuple[str, dict[str, str]]:
    """The name and values of a metadata message on NOTES_TOPIC. Raises KbotError: KBot did not write it."""
    values = {key: str(value) for key, value in read_fields(entry).items()}
    return values.pop("name", ""), values


def read_fields(entry: RecordedMessage) -> dict[str, object]:
    """The JSON object in a String message that KBot wrote. Raises KbotError: KBot did not write it."""
    try:
        found = parse_json(read_text(entry))
    except ValueError:
        found = None
    if not isinstance(found, dict):
        raise KbotError(f"{entry.place} was not written by KBot")
    return found


def read_text(entry: RecordedMessage) -> str:
    """The text of a String message. Raises KbotError: it is not a String message."""
    if entry.type_name != TEXT:
        raise KbotError(f"{entry.place} carries {entry.type_name}, not {TEXT}")
    return str(entry.message().data)
