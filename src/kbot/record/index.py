"""Random access to recordings by time, through the file's index or by reading the whole file into memory."""

from __future__ import annotations

import heapq
from bisect import bisect_right
from collections.abc import Collection, Iterator, Mapping
from pathlib import Path

from kbot.brief import Brief, counted
from kbot.record.entry import RecordedMessage
from kbot.record.formats import NOTES_TOPIC, Index, NoIndex
from kbot.record.limits import memory_limit
from kbot.record.reader import Recording
from kbot.text import KbotError
from kbot.text.errors import reading

ENTRY_BYTES = 500
"""Memory that a message takes in addition to its bytes."""


class WholeIndex(Brief):
    """A recording held in memory. If a run was set back in time, the later messages replace the earlier
    ones."""

    def __init__(self, path: str) -> None:
        """Raises KbotError: the recording cannot be read, or is too large."""
        entries: dict[str, list[RecordedMessage]] = {}
        recording = Recording(path)
        summary = recording.summary()
        self.notes: Mapping[str, Mapping[str, str]] = summary.notes
        self.broken = summary.broken
        left = memory_limit(path)
        for entry in recording.entries():
            if entry.topic != NOTES_TOPIC:
                left -= len(entry.data) + ENTRY_BYTES
                if left < 0:
                    raise KbotError(f"{path} has no usable index, and is too large to read into memory")
                messages = entries.setdefault(entry.topic, [])
                while messages and messages[-1].nanoseconds > entry.nanoseconds:
                    messages.pop()
                messages.append(entry)
        self._entries = entries
        self._times = {
            topic: [entry.nanoseconds for entry in messages] for topic, messages in entries.items()
        }
        self.topics = {topic: messages[0].type_name for topic, messages in entries.items()}
        self.latched = {topic for topic, messages in entries.items() if messages[0].is_latched}
        self.counts = {topic: len(messages) for topic, messages in entries.items()}
        self.start = min((times[0] for times in self._times.values()), default=0)
        self.end = max((times[-1] for times in self._times.values()), default=0)

    def newest(self, topic: str, nanoseconds: int) -> RecordedMessage | None:
        index = bisect_right(self._times.get(topic, []), nanoseconds)
        return self._entries[topic][index - 1] if index else None

    def between(self, topics: Collection[str], after: int, until: int) -> Iterator[RecordedMessage]:
        parts = [self._part(topic, after, until) for topic in topics if topic in self._times]
        return heapq.merge(*parts, key=lambda entry: entry.nanoseconds)

    def damage(self, nanoseconds: int) -> None:
        return None

    def close(self) -> None:
        self._entries.clear()
        self._times.clear()

    def _part(self, topic: str, after: int, until: int) -> list[RecordedMessage]:
        times = self._times[topic]
        return self._entries[topic][bisect_right(times, after) : bisect_right(times, until)]

    def _shown(self) -> Iterator[str]:
        yield counted(len(self.topics), "topic")


def open_index(path: str) -> Index:
    """Open a recording for access by time.

    Raises:
        KbotError: there is no such recording, or it cannot be read.
    """
    Recording(path)  # reports a missing file or an unknown suffix
    with reading(path):
        return _opened(path)


def _opened(path: str) -> Index:
    if Path(path).suffix == ".mcap" and not Path(path).is_dir():
        from kbot.record.mcap_file import McapIndex  # imported lazily: only MCAP files need it

        try:
            return McapIndex(path)
        except NoIndex:
            return WholeIndex(path)
    from kbot.record.bags.index import Ros1Index, Ros2Index

    try:
        return Ros2Index(path) if Path(path).is_dir() else Ros1Index(path)
    except NoIndex:
        return WholeIndex(path)
