"""Reads recordings of all formats (MCAP, ROS 1 bag, rosbag2), also incomplete ones."""

from __future__ import annotations

import heapq
from collections.abc import Iterator, Sequence
from contextlib import suppress
from dataclasses import dataclass, field
from pathlib import Path

from kbot.brief import Brief, counted
from kbot.record.entry import RecordedMessage
from kbot.record.formats import NOTES_TOPIC, BrokenOff, RecordingSource, read_note
from kbot.record.names import BAGS
from kbot.text import KbotError
from kbot.text.errors import reading
from kbot.text.files import refuse_lfs_pointer
from kbot.text.folders import names_in
from kbot.text.suggest import did_you_mean


@dataclass
class TopicSummary:
    """`unusable` is the reason why the messages cannot be read, empty if they can."""

    type_name: str
    count: int = 0
    unusable: str = ""
    is_latched: bool = False
    """Whether late subscribers received its last message."""


@dataclass(repr=False)
class Summary(Brief):
    """The contents of a recording. Times are nanoseconds of its clock. `broken` is the reason why it is
    incomplete."""

    kind: str
    topics: dict[str, TopicSummary] = field(default_factory=dict)
    notes: dict[str, dict[str, str]] = field(default_factory=dict)
    start: int | None = None
    end: int | None = None
    broken: str = ""

    @property
    def count(self) -> int:
        return sum(topic.count for topic in self.topics.values())

    @property
    def unusable(self) -> dict[str, str]:
        """Why the messages of some topics cannot be read, by topic."""
        return {name: topic.unusable for name, topic in self.topics.items() if topic.unusable}

    @property
    def seconds(self) -> float:
        """Time from the first message to the last."""
        return 0.0 if self.start is None or self.end is None else (self.end - self.start) * 1e-9

    def _shown(self) -> Iterator[str]:
        yield self.kind
        yield counted(len(self.topics), "topic")
        yield counted(self.count, "message")
        yield f"{self.seconds:g} s"


class Recording(Brief):
    """A recording on disk. Each method reads it again, one message at a time."""

    def __init__(self, path: str) -> None:
        """Raises KbotError: the file does not exist, or is not a recording."""
        self.path = path
        self._source = _source(path)

    def entries(self) -> Iterator[RecordedMessage]:
        """Every message up to the end of the readable part."""
        with reading(self.path), suppress(BrokenOff):
            yield from self._source.entries(lambda name, values: None)

    def summary(self) -> Summary:
        """Read the whole file and summarise it. Raises KbotError: it is not a recording."""
        with reading(self.path):
            return self._summary()

    def _summary(self) -> Summary:
        found = Summary(self._source.kind)
        try:
            for entry in self._source.entries(found.notes.__setitem__):
                if entry.topic == NOTES_TOPIC:
                    name, values = read_note(entry)
                    found.notes[name] = values
                    continue
                topic = found.topics.get(entry.topic)
                if topic is None:
                    topic = TopicSummary(entry.type_name, is_latched=entry.is_latched)
                    found.topics[entry.topic] = topic
                topic.count += 1
                topic.unusable = entry.unusable
                at = entry.nanoseconds
                found.start = at if found.start is None else min(found.start, at)
                found.end = at if found.end is None else max(found.end, at)
        except BrokenOff as error:
            found.broken = str(error)
        return found

    def require_topics(self, topics: tuple[str, ...]) -> tuple[str, ...]:
        """The recorded names of topics, as `require_topics` finds them."""
        return require_topics(self.path, self.summary(), topics)

    def _shown(self) -> Iterator[str]:
        yield repr(self.path)
        yield self._source.kind


class Recordings:
    """Several recordings, merged by time."""

    def __init__(self, paths: Sequence[str]) -> None:
        """Raises KbotError: a file does not exist, or is not a recording."""
        self._all = [Recording(path) for path in paths]
        self.path = ", ".join(paths)

    def entries(self) -> Iterator[RecordedMessage]:
        """Every message of all recordings, each up to the end of its readable part."""
        return heapq.merge(
            *(recording.entries() for recording in self._all), key=lambda entry: entry.nanoseconds
        )

    def summary(self) -> Summary:
        """Read all files and summarise them. `broken` names the incomplete ones with their reasons.

        Raises:
            KbotError: a file is not a recording, or a topic has two types.
        """
        every = [recording.summary() for recording in self._all]
        topics: dict[str, TopicSummary] = {}
        for name, found in ((name, topic) for summary in every for name, topic in summary.topics.items()):
            new = TopicSummary(found.type_name, unusable=found.unusable, is_latched=found.is_latched)
            known = topics.setdefault(name, new)
            if known.type_name != found.type_name:
                raise KbotError(f"{self.path}: {name} has two types, {known.type_name} and {found.type_name}")
            known.count += found.count
        notes = {name: values for summary in reversed(every) for name, values in summary.notes.items()}
        starts = [summary.start for summary in every if summary.start is not None]
        ends = [summary.end for summary in every if summary.end is not None]
        broken = "; ".join(
            f"{recording.path} is incomplete: {summary.broken}"
            for recording, summary in zip(self._all, every, strict=True)
            if summary.broken
        )
        return Summary(
            every[0].kind, topics, notes, min(starts, default=None), max(ends, default=None), broken
        )


def require_topics(path: str, summary: Summary, topics: tuple[str, ...]) -> tuple[str, ...]:
    """The recorded names of topics: `odom` matches `/odom` too. Raises KbotError: a topic is not recorded."""
    found = []
    for topic in topics:
        name = next((name for name in (topic, f"/{topic}") if name in summary.topics), None)
        if name is None:
            hint = did_you_mean(topic, summary.topics)
            raise KbotError(f"{path} has no topic {topic}" + (f": {hint}" if hint else ""))
        found.append(name)
    return tuple(found)


def readable_part(path: str) -> str:
    """A clause that describes what can be read of an incomplete recording."""
    try:
        found = Recording(path).summary()
    except KbotError as error:
        return f"no part of it can be read: {error}"
    if found.end is None:
        return "it has no messages"
    return f"{found.count} messages up to {found.end * 1e-9:.2f} s can be read"


def _source(path: str) -> RecordingSource:
    file = Path(path)
    if not file.exists():
        hint = did_you_mean(file.name, names_in(file.parent))
        raise KbotError(f"{path} does not exist" + (f": {hint}" if hint else ""))
    if not (file.is_dir() or file.is_file()):
        raise KbotError(f"{path} is neither a file nor a folder")
    for part in (file, *file.glob("*.db3*"), *file.glob("*.mcap*")):  # a file has no parts
        if part.is_file():
            try:
                refuse_lfs_pointer(part)
            except OSError as error:
                raise KbotError(f"{part} cannot be read: {error.strerror}") from None
    if file.is_dir() or path.endswith(BAGS):
        # imported lazily: only bags need it
        from kbot.record.bags.reader import Ros1Source, Ros2Source

        return Ros2Source(path) if file.is_dir() else Ros1Source(path)
    if file.suffix == ".mcap":
        from kbot.record.mcap_file import McapSource

        return McapSource(path)
    raise KbotError(f"{path} is not a recording: use a .mcap or .bag file, or a rosbag2 folder")
