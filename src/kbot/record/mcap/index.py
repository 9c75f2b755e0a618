"""MCAP files by their index: any moment is found without reading what lies before it."""

from __future__ import annotations

from bisect import bisect_right
from collections import Counter, OrderedDict
from collections.abc import Collection, Iterable, Iterator
from contextlib import suppress
from itertools import pairwise
from pathlib import Path
from typing import IO

from mcap.data_stream import ReadDataStream
from mcap.reader import make_reader
from mcap.records import Chunk, ChunkIndex, Message, Metadata, MetadataIndex
from mcap.stream_reader import breakup_chunk

from kbot.record.entry import Entry, Types
from kbot.record.formats import NoIndex
from kbot.record.mcap.reader import CARRIED, RECORD_HEAD, full_name, unreadable
from kbot.text import KbotError

KEPT_CHUNKS = 8
ALLOWED_DISORDER = 100_000_000
"""Nanoseconds that a message may be written after a later one; more is a clock that was set back."""


class McapIndex:
    """One file, opened for each chunk that is read."""

    broken = ""

    def __init__(self, path: str) -> None:
        """Raises NoIndex."""
        self._path = path
        try:
            with Path(path).open("rb") as stream:
                summary = make_reader(stream).get_summary()
                self.notes = dict(_notes(stream, summary.metadata_indexes if summary else ()))
        except faults() as error:
            raise NoIndex(f"{path} has no index: {error}") from None
        if summary is None or not summary.chunk_indexes:
            raise NoIndex(f"{path} has no index")
        in_file = sorted(summary.chunk_indexes, key=lambda index: index.chunk_start_offset)
        if any(b.message_start_time < a.message_end_time - ALLOWED_DISORDER for a, b in pairwise(in_file)):
            raise NoIndex(f"{path} goes back in time")
        self._chunks = in_file
        types = Types()
        for schema in summary.schemas.values():
            if schema.encoding in ("ros2msg", "ros1msg"):
                types.learn(full_name(schema.name), schema.data.decode(errors="replace"))
        self._types = types
        self._channels = {
            number: (
                channel.topic,
                full_name(summary.schemas[channel.schema_id].name),
                channel.message_encoding,
            )
            for number, channel in summary.channels.items()
            if channel.message_encoding in CARRIED and channel.schema_id in summary.schemas
        }
        self.topics = {topic: type_name for topic, type_name, _ in self._channels.values()}
        counted = summary.statistics.channel_message_counts if summary.statistics else {}
        self.counts: Counter[str] = Counter()
        for number, count in counted.items():
            if number in self._channels:
                self.counts[self._channels[number][0]] += count
        self.start = min(index.message_start_time for index in in_file)
        self.end = max(index.message_end_time for index in in_file)
        self._opened: OrderedDict[int, list[Entry]] = OrderedDict()
        self._lost: set[int] = set()
        """Where the chunks begin that were found damaged."""
        said = [entry.nanoseconds for entry in self._said(in_file[-1])]
        if any(b < a - ALLOWED_DISORDER for a, b in pairwise(said)):
            raise NoIndex(f"{path} goes back in time at its end")

    def close(self) -> None:
        self._opened.clear()

    def newest(self, topic: str, nanoseconds: int) -> Entry | None:
        """What a topic said last until a time."""
        for index in reversed(self._chunks):
            if index.message_start_time <= nanoseconds and self._has(index, (topic,)):
                told = [entry for entry in self._entries(index) if entry.topic == topic]
                at = bisect_right(told, nanoseconds, key=lambda entry: entry.nanoseconds)
                if at:
                    return told[at - 1]
        return None

    def between(self, topics: Collection[str], after: int, until: int) -> Iterator[Entry]:
        """What these topics said after a time and until another, in its order."""
        first = bisect_right(self._chunks, after, key=lambda index: index.message_end_time)
        found: list[Entry] = []
        for index in self._chunks[first:]:
            if index.message_start_time > until:
                break
            if self._has(index, topics):
                found += [
                    e for e in self._entries(index) if after < e.nanoseconds <= until and e.topic in topics
                ]
        yield from sorted(found, key=lambda entry: entry.nanoseconds)

    def damage(self, nanoseconds: int) -> tuple[int, int] | None:
        """From when on nothing can be read, and when the next whole chunk begins."""
        chunks = self._chunks
        at = bisect_right(chunks, nanoseconds, key=lambda index: index.message_start_time) - 1
        if at < 0 or not self._is_lost(chunks[at]):
            return None
        first, last = at, at
        while first > 0 and self._is_lost(chunks[first - 1]):
            first -= 1
        while last + 1 < len(chunks) and self._is_lost(chunks[last + 1]):
            last += 1
        start = chunks[first].message_start_time
        end = chunks[last].message_end_time + 1
        return start, max(end, chunks[last + 1].message_start_time) if last + 1 < len(chunks) else end

    def _is_lost(self, index: ChunkIndex) -> bool:
        self._entries(index)
        return index.chunk_start_offset in self._lost

    def _has(self, index: ChunkIndex, topics: Collection[str]) -> bool:
        held = index.message_index_offsets
        if not held:
            return True  # written without: the chunk itself is to be asked
        return any(number in self._channels and self._channels[number][0] in topics for number in held)

    def _entries(self, index: ChunkIndex) -> list[Entry]:
        at = index.chunk_start_offset
        if at in self._opened:
            self._opened.move_to_end(at)
            return self._opened[at]
        self._opened[at] = entries = sorted(self._said(index), key=lambda entry: entry.nanoseconds)
        if len(self._opened) > KEPT_CHUNKS:
            self._opened.popitem(last=False)
        return entries

    def _said(self, index: ChunkIndex) -> list[Entry]:
        """As it was written; nothing where it is damaged. Raises KbotError: the file is gone."""
        try:
            with Path(self._path).open("rb") as stream:
                stream.seek(index.chunk_start_offset + RECORD_HEAD)
                records = breakup_chunk(Chunk.read(ReadDataStream(stream)), validate_crc=True)
        except OSError as error:
            raise KbotError(f"{self._path} cannot be read: {error.strerror or error}") from None
        except faults():
            self._lost.add(index.chunk_start_offset)
            return []
        return [self._entry(r) for r in records if isinstance(r, Message) and r.channel_id in self._channels]

    def _entry(self, record: Message) -> Entry:
        topic, type_name, encoding = self._channels[record.channel_id]
        return Entry(topic, type_name, record.log_time, record.data, self._types, is_ros1=encoding == "ros1")


def _notes(stream: IO[bytes], places: Iterable[MetadataIndex]) -> Iterator[tuple[str, dict[str, str]]]:
    for place in places:
        stream.seek(place.offset + RECORD_HEAD)
        with suppress(*unreadable()):
            found = Metadata.read(ReadDataStream(stream))
            yield found.name, dict(found.metadata)


def faults() -> tuple[type[Exception], ...]:
    """What reading a file at any place raises where it is broken, or gone."""
    return (*unreadable(), OSError)
