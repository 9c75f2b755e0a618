"""Random access to recordings by time, with the file's index or, without one, after reading it once."""

from __future__ import annotations

import heapq
from bisect import bisect_right
from collections.abc import Collection, Iterator, Mapping
from pathlib import Path

from kbot.record.entry import RecordedMessage
from kbot.record.formats import NOTES_TOPIC, Index, NoIndex
from kbot.record.limits import kept_bytes
from kbot.record.reader import Recording
from kbot.text import KbotError
from kbot.text.errors import reading

ENTRY_BYTES = 500
"""What a message takes in memory beside its bytes."""


class WholeIndex:
    """A recording held in memory. Where a run was set back in time, what came later counts."""

    def __init__(self, path: str) -> None:
        """Raises KbotError: there is no such recording."""
        entries: dict[str, list[RecordedMessage]] = {}
        recording = Recording(path)
        summary = recording.summary()
        self.notes: Mapping[str, Mapping[str, str]] = summary.notes
        self.broken = summary.broken
        left = kept_bytes(path)
        for entry in recording.entries():
            if entry.topic != NOTES_TOPIC:
                left -= len(entry.data) + ENTRY_BYTES
                if left < 0:
                    raise KbotError(f"{path} has no usable index, and is too large to be held in memory")
                told = entries.setdefault(entry.topic, [])
                while told and told[-1].nanoseconds > entry.nanoseconds:
                    told.pop()
                told.append(entry)
        self._entries = entries
        self._times = {topic: [entry.nanoseconds for entry in told] for topic, told in entries.items()}
        self.topics = {topic: told[0].type_name for topic, told in entries.items()}
        self.counts = {topic: len(told) for topic, told in entries.items()}
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


def open_index(path: str) -> Index:
    """Open a recording to ask it by time.

    Raises:
        KbotError: there is no such recording, or it cannot be read.
    """
    Recording(path)  # reports what is wrong with the name
    with reading(path):
        return _opened(path)


def _opened(path: str) -> Index:
    if Path(path).suffix == ".mcap" and not Path(path).is_dir():
        from kbot.record.mcap_file import McapIndex  # lazy in this module: one format needs no other's reader

        try:
            return McapIndex(path)
        except NoIndex:
            return WholeIndex(path)
    from kbot.record.bags.index import Ros1Index, Ros2Index

    try:
        return Ros2Index(path) if Path(path).is_dir() else Ros1Index(path)
    except NoIndex:
        return WholeIndex(path)
