"""Random access to ROS 1 bags and rosbag2 folders by time, with their index."""

from __future__ import annotations

import heapq
import weakref
from collections import Counter, deque
from collections.abc import Callable, Collection, Iterator
from contextlib import ExitStack
from pathlib import Path

from kbot.record.bags.reader import UNREADABLE, one_line, read_folder, unreadable_error
from kbot.record.bags.ros1_reader import Chunk, Ros1Bag
from kbot.record.bags.sqlite_file import SqliteFile
from kbot.record.chunks import ChunkCache, in_time_order
from kbot.record.entry import RecordedMessage, Types
from kbot.record.formats import NOTES_TOPIC, read_note
from kbot.record.limits import Allowance, RecordingTooLarge
from kbot.record.mcap_file import McapIndex
from kbot.text import KbotError

FIRST_WINDOW = 1_000_000_000
"""Nanoseconds before a time that are searched first for a topic's last message. Each further search covers
eight times the span before it."""

Between = Callable[[Collection[str], int, int], Iterator[RecordedMessage]]


class Ros1Index:
    """Access to one bag by time. The file is opened for each chunk that is read."""

    broken = ""

    def __init__(self, path: str) -> None:
        """Raises KbotError: it is not a ROS 1 bag; NoIndex: it has no index."""
        self._path = path
        self._bag = bag = Ros1Bag(path)
        bag.read_index()
        self._opened = ChunkCache()
        self.topics = dict(bag.connections.values())
        self.latched = bag.latched
        self.counts: Counter[str] = Counter()
        for chunk in bag.chunks:
            for number, count in chunk.counts.items():
                if number in bag.connections:
                    self.counts[bag.connections[number][0]] += count
        self.start = min((chunk.start for chunk in bag.chunks if chunk.counts), default=0)
        self.end = max((chunk.end for chunk in bag.chunks if chunk.counts), default=0)
        self.notes = _notes(self.between, self.start, self.end)

    def damage(self, nanoseconds: int) -> None:
        return None

    def close(self) -> None:
        self._opened.clear()

    def newest(self, topic: str, nanoseconds: int) -> RecordedMessage | None:
        """The last message of a topic until a time."""
        return _newest(self.between, topic, self.start, nanoseconds) if topic in self.topics else None

    def between(self, topics: Collection[str], after: int, until: int) -> Iterator[RecordedMessage]:
        """The messages of topics after one time and until another, sorted by time."""
        allowance, bag = Allowance(self._path), self._bag

        def messages(chunk: Chunk) -> Iterator[RecordedMessage]:
            for entry in self._opened.entries(chunk.at, lambda: bag.messages(chunk, allowance)):
                if after < entry.nanoseconds <= until and entry.topic in topics:
                    yield entry

        wanted = {number for number, (name, _) in bag.connections.items() if name in topics}
        chunks = (
            (chunk.start, messages(chunk))
            for chunk in bag.chunks
            if chunk.start <= until and chunk.end > after and not wanted.isdisjoint(chunk.counts)
        )
        try:
            yield from in_time_order(chunks)
        except RecordingTooLarge as error:
            raise KbotError(f"{self._path}: {error}") from None


class Ros2Index:
    """Access to one folder by time. Its files stay open until `close` or until the object is deleted."""

    broken = ""

    def __init__(self, path: str) -> None:
        """Raises KbotError: it is not a rosbag2 folder; NoIndex: it has no metadata."""
        self._path = Path(path)
        self._folder = read_folder(self._path)
        stack = ExitStack()
        self._closing = weakref.finalize(self, stack.close)
        types = Types(path)
        self._parts: list[McapIndex | SqliteFile] = []
        self.topics: dict[str, str] = {}
        self.latched: set[str] = set()
        self.counts: Counter[str] = Counter()
        spans: list[tuple[int, int]] = []
        try:
            for file in stack.enter_context(self._folder.opened(Allowance(path))):
                part = (
                    McapIndex(str(file))
                    if self._folder.storage == "mcap"
                    else SqliteFile(file, types, is_closed=True)
                )
                stack.callback(part.close)
                self._parts.append(part)
                self.latched |= part.latched
                if isinstance(part, McapIndex):
                    self.topics |= part.topics
                    self.counts.update(part.counts)
                    spans.append((part.start, part.end))
                else:
                    self.topics |= dict(part.topics.values())
                    self.counts.update(part.counts())
                    spans += filter(None, (part.span(),))
        except UNREADABLE as error:
            self.close()
            raise unreadable_error(self._path, error) from None
        except RecordingTooLarge as error:
            self.close()
            raise KbotError(f"{path}: {error}") from None
        except KbotError:
            self.close()
            raise
        self.start = min((start for start, _ in spans), default=0)
        self.end = max((end for _, end in spans), default=0)
        self.notes = _notes(self.between, self.start, self.end)
        for part in self._parts:
            if isinstance(part, McapIndex):
                self.notes |= part.notes

    def damage(self, nanoseconds: int) -> tuple[int, int] | None:
        found = (part.damage(nanoseconds) for part in self._parts if isinstance(part, McapIndex))
        return next(filter(None, found), None)

    def close(self) -> None:
        self._closing()

    def newest(self, topic: str, nanoseconds: int) -> RecordedMessage | None:
        """The last message of a topic until a time."""
        return _newest(self.between, topic, self.start, nanoseconds) if topic in self.topics else None

    def between(self, topics: Collection[str], after: int, until: int) -> Iterator[RecordedMessage]:
        """The messages of topics after one time and until another, sorted by time."""
        allowance = Allowance(self._path)
        try:
            parts = [
                part.between(topics, after, until)
                if isinstance(part, McapIndex)
                else part.between(topics, after, until, allowance)
                for part in self._parts
            ]
            for entry in heapq.merge(*parts, key=lambda entry: entry.nanoseconds):
                yield self._folder.whole(entry, allowance)
        except UNREADABLE as error:
            raise KbotError(f"{self._path} is damaged: {one_line(error)}") from None
        except RecordingTooLarge as error:
            raise KbotError(f"{self._path}: {error}") from None


def _newest(between: Between, topic: str, start: int, nanoseconds: int) -> RecordedMessage | None:
    window, before = FIRST_WINDOW, nanoseconds
    while before >= start:
        after = max(nanoseconds - window, start - 1)
        found = deque(between((topic,), after, before), maxlen=1)
        if found:
            return found[0]
        before, window = after, window * 8
    return None


def _notes(between: Between, start: int, end: int) -> dict[str, dict[str, str]]:
    return dict(map(read_note, between((NOTES_TOPIC,), start - 1, end)))
