"""MCAP files by their index: any moment is found without reading what lies before it."""

from __future__ import annotations

from bisect import bisect_right
from collections import Counter
from collections.abc import Collection, Iterable, Iterator
from itertools import pairwise
from pathlib import Path
from typing import IO

from mcap.opcode import Opcode
from mcap.records import ChunkIndex, Message, Metadata, MetadataIndex

from kbot.record.chunks import KeptChunks, in_time_order
from kbot.record.encodings.foreign_types import full_name
from kbot.record.entry import Entry, Types
from kbot.record.formats import NoIndex
from kbot.record.limits import Allowance, Damaged, TooLarge
from kbot.record.mcap.reader import CARRIED, chunk_at, learn
from kbot.record.mcap.records import MAGIC, break_up, read_summary, record_at
from kbot.text import KbotError

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
                if stream.read(len(MAGIC)) != MAGIC:
                    raise Damaged("it does not begin as an MCAP file")
                summary = read_summary(stream)
                self.notes = dict(_notes(stream, summary.metadata_indexes if summary else ()))
        except (Damaged, OSError) as error:
            raise NoIndex(f"{path} has no index: {error}") from None
        if summary is None or not summary.chunk_indexes:
            raise NoIndex(f"{path} has no index")
        by_offset = {index.chunk_start_offset: index for index in summary.chunk_indexes}
        in_file = [by_offset[offset] for offset in sorted(by_offset)]
        if any(b.message_start_time < a.message_end_time - ALLOWED_DISORDER for a, b in pairwise(in_file)):
            raise NoIndex(f"{path} goes back in time")
        self._chunks = in_file
        types = Types(path)
        for schema in summary.schemas.values():
            learn(types, schema)
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
        self._opened = KeptChunks()
        self._lost: set[int] = set()
        """Where the chunks begin that were found damaged."""
        last = [entry.nanoseconds for entry in self._read(in_file[-1], Allowance(path))]
        if any(b < a - ALLOWED_DISORDER for a, b in pairwise(last)):
            raise NoIndex(f"{path} goes back in time at its end")

    def close(self) -> None:
        self._opened.clear()

    def newest(self, topic: str, nanoseconds: int) -> Entry | None:
        """A topic's last message until a time."""
        allowance = Allowance(self._path)
        for index in reversed(self._chunks):
            if index.message_start_time <= nanoseconds and self._has(index, (topic,)):
                found = [entry for entry in self._entries(index, allowance) if entry.topic == topic]
                at = bisect_right(found, nanoseconds, key=lambda entry: entry.nanoseconds)
                if at:
                    return found[at - 1]
        return None

    def between(self, topics: Collection[str], after: int, until: int) -> Iterator[Entry]:
        """The messages of topics after a time and until another, in its order."""
        first = bisect_right(self._chunks, after, key=lambda index: index.message_end_time)
        allowance = Allowance(self._path)

        def chunks() -> Iterator[tuple[int, Iterable[Entry]]]:
            for index in self._chunks[first:]:
                if index.message_start_time > until:
                    return
                if self._has(index, topics):
                    entries = self._entries(index, allowance)
                    wanted = (e for e in entries if after < e.nanoseconds <= until and e.topic in topics)
                    yield index.message_start_time, wanted

        try:
            yield from in_time_order(chunks())
        except TooLarge as error:
            raise KbotError(f"{self._path}: {error}") from None

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
        self._entries(index, Allowance(self._path))
        return index.chunk_start_offset in self._lost

    def _has(self, index: ChunkIndex, topics: Collection[str]) -> bool:
        held = index.message_index_offsets
        if not held:
            return True  # written without: only the chunk itself has its topics
        return any(number in self._channels and self._channels[number][0] in topics for number in held)

    def _entries(self, index: ChunkIndex, allowance: Allowance) -> list[Entry]:
        return self._opened.entries(index.chunk_start_offset, lambda: self._read(index, allowance))

    def _read(self, index: ChunkIndex, allowance: Allowance) -> list[Entry]:
        """As it was written; nothing where it is damaged. Raises KbotError: the file is gone."""
        at = index.chunk_start_offset
        try:
            with Path(self._path).open("rb") as stream:
                found = break_up(chunk_at(stream, at), at, allowance)
        except OSError as error:
            raise KbotError(f"{self._path} cannot be read: {error.strerror or error}") from None
        except TooLarge as error:
            raise KbotError(f"{self._path}: {error}") from None
        except Damaged:
            self._lost.add(at)
            return []
        return [self._entry(r) for r in found if isinstance(r, Message) and r.channel_id in self._channels]

    def _entry(self, record: Message) -> Entry:
        topic, type_name, encoding = self._channels[record.channel_id]
        return Entry(topic, type_name, record.log_time, record.data, self._types, is_ros1=encoding == "ros1")


def _notes(stream: IO[bytes], places: Iterable[MetadataIndex]) -> Iterator[tuple[str, dict[str, str]]]:
    for place in places:
        try:
            found = record_at(stream, place.offset, Opcode.METADATA)
        except Damaged:
            continue
        if isinstance(found, Metadata):
            yield found.name, dict(found.metadata)
