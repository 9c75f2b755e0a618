"""Reads MCAP files. The index gives access to any time without reading the file up to it."""

from __future__ import annotations

import zlib
from bisect import bisect_right
from collections import Counter
from collections.abc import Collection, Iterable, Iterator, Mapping
from dataclasses import dataclass, field
from io import SEEK_END, BytesIO
from itertools import pairwise
from pathlib import Path
from struct import error as StructError
from typing import IO

from kbot.brief import Brief, counted
from kbot.record.chunks import ChunkCache, in_time_order
from kbot.record.encodings.foreign_types import full_name
from kbot.record.encodings.quality import latches, offered_qos
from kbot.record.entry import RecordedMessage, Types
from kbot.record.formats import BrokenOff, NoIndex, Note
from kbot.record.limits import (
    LARGEST_PIECE,
    Allowance,
    Damaged,
    RecordingTooLarge,
    check_length,
    check_names,
    inflate,
)
from kbot.record.mcap_records import (
    HEAD,
    MAGIC,
    MESSAGE,
    Channel,
    Chunk,
    ChunkIndex,
    DataEnd,
    Footer,
    Header,
    McapRecord,
    Message,
    Metadata,
    MetadataIndex,
    Opcode,
    Schema,
    Statistics,
)
from kbot.text import KbotError

_CRC_BYTES = 1 << 20
_PARSED: Mapping[int, type[McapRecord]] = {
    kind.OPCODE: kind
    for kind in (
        Channel,
        Chunk,
        ChunkIndex,
        DataEnd,
        Footer,
        Header,
        Metadata,
        MetadataIndex,
        Schema,
        Statistics,
    )
}
IN_FILE = (
    *(Opcode.SCHEMA, Opcode.CHANNEL, Opcode.MESSAGE, Opcode.CHUNK, Opcode.METADATA, Opcode.DATA_END),
    *(Opcode.HEADER, Opcode.FOOTER),
)
IN_CHUNK = (Opcode.SCHEMA, Opcode.CHANNEL, Opcode.MESSAGE)
_WITH_TEXTS = (Opcode.CHANNEL, Opcode.METADATA)
"""Records with a map of texts, which takes as long to read as the definition of a type."""
IN_SUMMARY = (
    *(Opcode.SCHEMA, Opcode.CHANNEL, Opcode.CHUNK_INDEX, Opcode.METADATA_INDEX, Opcode.STATISTICS),
    Opcode.FOOTER,
)


def records(
    stream: IO[bytes], start: int, end: int, wanted: Collection[int], allowance: Allowance | None = None
) -> Iterator[tuple[int, McapRecord]]:
    """The wanted records between two offsets of a stream, each with its offset. Others are skipped without
    reading.

    Raises:
        Damaged: a record is damaged.
        OSError: the file cannot be read.
        RecordingTooLarge: the allowance is used up. Each record is charged to it, and the texts of maps.
    """
    at = start
    while at < end:
        if allowance is not None:
            allowance.charge(records=1)
        stream.seek(at)
        head = stream.read(HEAD.size)
        if len(head) < HEAD.size:
            raise Damaged(f"it ends in the middle of the record at byte {at:,}")
        kind, length = HEAD.unpack(head)
        left = end - at - HEAD.size
        check_length(at, length, left, is_skipped=kind not in wanted)
        if kind in wanted:
            if allowance is not None and kind in _WITH_TEXTS:
                allowance.charge(characters=length)
            yield at, _parsed(stream, kind, length, at)
        at += HEAD.size + length


def record_at(stream: IO[bytes], at: int, kind: Opcode, allowance: Allowance | None = None) -> McapRecord:
    """The record at an offset from an index.

    Raises:
        Damaged: there is no such record.
        RecordingTooLarge: the allowance is used up.
    """
    end = stream.seek(0, SEEK_END)
    if at < end:  # a larger offset may be one that the system cannot seek to
        stream.seek(at)
        # `records` would skip all records of other kinds up to the end of the file
        if stream.read(1) == bytes((kind,)):
            _, record = next(records(stream, at, end, (kind,), allowance))
            return record
    raise Damaged(f"there is no {kind.name.lower()} at byte {at:,}")


def _parsed(stream: IO[bytes], kind: int, length: int, at: int) -> McapRecord:
    try:
        if kind == Opcode.MESSAGE:
            channel, sequence, logged, published = MESSAGE.unpack(stream.read(min(length, MESSAGE.size)))
            return Message(channel, sequence, logged, published, stream.read(length - MESSAGE.size))
        return _PARSED[kind].read(stream.read(length))
    except (StructError, ValueError, OverflowError) as error:
        raise Damaged(f"the record at byte {at:,} is damaged: {error}") from None


def chunk_records(chunk: Chunk, at: int, allowance: Allowance) -> list[McapRecord]:
    """The records in the chunk at an offset.

    Raises:
        Damaged: the chunk is damaged.
        RecordingTooLarge: reading it would cost too much.
    """
    if chunk.compression not in ("", "zstd", "lz4"):  # https://mcap.dev/spec/registry
        raise Damaged(f"the chunk at byte {at:,} has the unknown compression {chunk.compression[:40]!r}")
    # charged first: a damaged chunk may take as long as a good one
    allowance.charge(min(chunk.uncompressed_size, LARGEST_PIECE), compression=chunk.compression)
    try:
        data = inflate(chunk.data, chunk.compression, chunk.uncompressed_size)
    except ValueError as error:
        raise Damaged(f"the chunk at byte {at:,} is damaged: {error}") from None
    except RecordingTooLarge as error:
        raise RecordingTooLarge(f"the chunk at byte {at:,} is not read: {error}") from None
    if chunk.uncompressed_crc not in (0, zlib.crc32(data)):
        raise Damaged(f"the chunk at byte {at:,} does not match its checksum")
    return [record for _, record in records(BytesIO(data), 0, len(data), IN_CHUNK, allowance)]


@dataclass
class Summary:
    """The records of the summary section."""

    statistics: Statistics | None = None
    schemas: dict[int, Schema] = field(default_factory=dict)
    channels: dict[int, Channel] = field(default_factory=dict)
    chunk_indexes: list[ChunkIndex] = field(default_factory=list)
    metadata_indexes: list[MetadataIndex] = field(default_factory=list)


def read_summary(stream: IO[bytes]) -> Summary | None:
    """Read the summary section. None if the file has none. Raises Damaged, OSError."""
    end = stream.seek(0, SEEK_END)
    footer_at = end - len(MAGIC) - HEAD.size - 20
    if footer_at < len(MAGIC):
        raise Damaged("it ends before its footer")
    footer = record_at(stream, footer_at, Opcode.FOOTER)
    start = footer.summary_start if isinstance(footer, Footer) else 0
    if start == 0:
        return None
    summary = Summary()
    for _, record in records(stream, start, footer_at, IN_SUMMARY):
        match record:
            case Statistics():
                summary.statistics = record
            case Schema():
                summary.schemas[record.id] = record
            case Channel():
                summary.channels[record.id] = record
            case ChunkIndex():
                summary.chunk_indexes.append(record)
            case MetadataIndex():
                summary.metadata_indexes.append(record)
    return summary


def check_data(stream: IO[bytes], end: int, data_end: DataEnd) -> None:
    """Check the checksum in the record at `end` over the file up to it. Raises Damaged if it does not
    match."""
    if data_end.data_section_crc == 0:
        return
    stream.seek(0)
    crc, left = 0, end
    while left > 0 and (data := stream.read(min(left, _CRC_BYTES))):
        crc, left = zlib.crc32(data, crc), left - len(data)
    if crc != data_end.data_section_crc:
        raise Damaged("its messages do not match their checksum")


READABLE_ENCODINGS = ("cdr", "ros1")


class McapSource:
    """Reads messages in CDR or ROS 1 encoding, and skips others."""

    kind = "MCAP"

    def __init__(self, path: str) -> None:
        self._path = path

    def entries(self, note: Note) -> Iterator[RecordedMessage]:
        """Every message in the order it was written, as `RecordingSource.entries` describes."""
        try:
            yield from self._entries(note, Allowance(self._path))
        except RecordingTooLarge as error:
            raise KbotError(f"{self._path}: {error}") from None

    def _entries(self, note: Note, allowance: Allowance) -> Iterator[RecordedMessage]:
        types = Types(self._path, allowance)
        names: dict[int, str] = {}
        channels: dict[int, tuple[str, int, str, str]] = {}
        for record in self._records(allowance):
            match record:
                case Schema():
                    check_names(record.name)
                    names[record.id] = full_name(record.name)
                    learn(types, record)
                case Channel():
                    check_names(record.topic, record.message_encoding)
                    encoding = record.message_encoding
                    channels[record.id] = record.topic, record.schema_id, encoding, _qos_of(record)
                case Metadata():
                    note(record.name, dict(record.metadata))
                case Message():
                    topic, schema, encoding, qos = channels.get(record.channel_id, ("", 0, "", ""))
                    if schema in names and encoding in READABLE_ENCODINGS:
                        yield RecordedMessage(
                            topic,
                            names[schema],
                            record.log_time,
                            record.data,
                            types,
                            is_ros1=encoding == "ros1",
                            qos=qos,
                        )

    def _records(self, allowance: Allowance) -> Iterator[McapRecord]:
        """The records of the file and of its chunks. Damaged chunks are left out."""
        chunks, is_begun = 0, False
        with Path(self._path).open("rb") as stream:
            size = stream.seek(0, SEEK_END)
            stream.seek(0)
            if stream.read(len(MAGIC)) != MAGIC[:size]:
                raise KbotError(f"{self._path} is not an MCAP file: its first bytes are wrong")
            try:
                for at, record in records(stream, len(MAGIC), size, IN_FILE):
                    is_begun = True
                    match record:
                        case Chunk():
                            within = chunk_records(record, at, allowance)
                            chunks += 1
                            yield from within
                        case DataEnd():
                            check_data(stream, at, record)
                        case Footer():
                            return
                        case _:
                            yield record
                raise Damaged("it has no footer")
            except Damaged:
                if not is_begun:
                    raise KbotError(
                        f"{self._path} is not an MCAP file: it ends before its first record"
                    ) from None
                yield from self._rest(stream, chunks, allowance)

    def _rest(self, stream: IO[bytes], chunks: int, allowance: Allowance) -> Iterator[McapRecord]:
        """The readable records after damage, found by the index. `chunks` is the number of chunks before it.

        Raises:
            BrokenOff: always, after all records.
        """
        try:
            summary = read_summary(stream)
        except Damaged:
            summary = None
        if summary is None:
            raise BrokenOff("it was not closed, so the data after its last complete chunk is lost")
        yield from (*summary.schemas.values(), *summary.channels.values())
        in_file = sorted({index.chunk_start_offset for index in summary.chunk_indexes})
        lost = 0
        for offset in in_file[chunks:]:
            try:
                within = chunk_records(chunk_at(stream, offset), offset, allowance)
            except Damaged:
                lost += 1
                continue
            yield from within
        for offset in _offsets(summary.metadata_indexes):
            try:
                yield record_at(stream, offset, Opcode.METADATA, allowance)
            except Damaged:
                continue
        raise BrokenOff(f"{lost} of its {len(in_file)} chunks are damaged and cannot be read")


def _qos_of(channel: Channel) -> str:
    """The quality of service of a channel. Those of ROS 1 have only `latching`."""
    if channel.metadata.get("latching") in ("1", "true"):
        return offered_qos(True)
    return channel.metadata.get("offered_qos_profiles", "")


def learn(types: Types, schema: Schema) -> None:
    """Register the type that a ROS schema defines. Raises KbotError: it does not follow the ROS grammar."""
    if schema.encoding in ("ros2msg", "ros1msg"):
        types.learn(full_name(schema.name), schema.data.decode(errors="replace"))


def chunk_at(stream: IO[bytes], offset: int) -> Chunk:
    """The chunk at an offset. Raises Damaged: there is none."""
    record = record_at(stream, offset, Opcode.CHUNK)
    if not isinstance(record, Chunk):
        raise Damaged(f"there is no chunk at byte {offset:,}")
    return record


ALLOWED_DISORDER = 100_000_000
"""Nanoseconds by which a message may be older than the one written before it. A larger step means that the
clock was set back."""


class McapIndex(Brief):
    """Access to one file by time. The file is opened for each chunk that is read."""

    broken = ""

    def __init__(self, path: str) -> None:
        """Raises NoIndex: the file has no usable index."""
        self._path = path
        try:
            with Path(path).open("rb") as stream:
                if stream.read(len(MAGIC)) != MAGIC:
                    raise Damaged("its first bytes are not those of an MCAP file")
                summary = read_summary(stream)
                places = summary.metadata_indexes if summary else ()
                self.notes = dict(_notes(stream, places, Allowance(path)))
        except (Damaged, OSError) as error:
            raise NoIndex(f"{path} has no index: {error}") from None
        except RecordingTooLarge as error:
            raise KbotError(f"{path}: {error}") from None
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
            if channel.message_encoding in READABLE_ENCODINGS and channel.schema_id in summary.schemas
        }
        self._qos = {number: _qos_of(summary.channels[number]) for number in self._channels}
        self.topics = {topic: type_name for topic, type_name, _ in self._channels.values()}
        self.latched = {
            topic for number, (topic, _, _) in self._channels.items() if latches(topic, self._qos[number])
        }
        counted = summary.statistics.channel_message_counts if summary.statistics else {}
        self.counts: Counter[str] = Counter()
        for number, count in counted.items():
            if number in self._channels:
                self.counts[self._channels[number][0]] += count
        self.start = min(index.message_start_time for index in in_file)
        self.end = max(index.message_end_time for index in in_file)
        self._opened = ChunkCache()
        self._lost: set[int] = set()
        """Offsets of damaged chunks."""
        last = [entry.nanoseconds for entry in self._read(in_file[-1], Allowance(path))]
        if any(b < a - ALLOWED_DISORDER for a, b in pairwise(last)):
            raise NoIndex(f"{path} goes back in time at its end")

    def close(self) -> None:
        self._opened.clear()

    def newest(self, topic: str, nanoseconds: int) -> RecordedMessage | None:
        """The last message of a topic until a time."""
        allowance = Allowance(self._path)
        for index in reversed(self._chunks):
            if index.message_start_time <= nanoseconds and self._has(index, (topic,)):
                found = [entry for entry in self._entries(index, allowance) if entry.topic == topic]
                at = bisect_right(found, nanoseconds, key=lambda entry: entry.nanoseconds)
                if at:
                    return found[at - 1]
        return None

    def between(self, topics: Collection[str], after: int, until: int) -> Iterator[RecordedMessage]:
        """The messages of topics after one time and until another, sorted by time."""
        first = bisect_right(self._chunks, after, key=lambda index: index.message_end_time)
        allowance = Allowance(self._path)

        def chunks() -> Iterator[tuple[int, Iterable[RecordedMessage]]]:
            for index in self._chunks[first:]:
                if index.message_start_time > until:
                    return
                if self._has(index, topics):
                    entries = self._entries(index, allowance)
                    wanted = (e for e in entries if after < e.nanoseconds <= until and e.topic in topics)
                    yield index.message_start_time, wanted

        try:
            yield from in_time_order(chunks())
        except RecordingTooLarge as error:
            raise KbotError(f"{self._path}: {error}") from None

    def damage(self, nanoseconds: int) -> tuple[int, int] | None:
        """The time from which nothing can be read, and the start of the next readable chunk."""
        chunks = self._chunks
        at = bisect_right(chunks, nanoseconds, key=lambda index: index.message_start_time) - 1
        allowance = Allowance(self._path)
        if at < 0 or not self._is_lost(chunks[at], allowance):
            return None
        first, last = at, at
        while first > 0 and self._is_lost(chunks[first - 1], allowance):
            first -= 1
        while last + 1 < len(chunks) and self._is_lost(chunks[last + 1], allowance):
            last += 1
        start = chunks[first].message_start_time
        end = chunks[last].message_end_time + 1
        return start, max(end, chunks[last + 1].message_start_time) if last + 1 < len(chunks) else end

    def _is_lost(self, index: ChunkIndex, allowance: Allowance) -> bool:
        if index.chunk_start_offset not in self._lost:
            self._entries(index, allowance)
        return index.chunk_start_offset in self._lost

    def _has(self, index: ChunkIndex, topics: Collection[str]) -> bool:
        held = index.message_index_offsets
        if not held:
            return (
                True  # the file was written without message indexes: only the chunk itself shows its topics
            )
        return any(number in self._channels and self._channels[number][0] in topics for number in held)

    def _entries(self, index: ChunkIndex, allowance: Allowance) -> list[RecordedMessage]:
        return self._opened.entries(index.chunk_start_offset, lambda: self._read(index, allowance))

    def _read(self, index: ChunkIndex, allowance: Allowance) -> list[RecordedMessage]:
        """The messages of a chunk in the order written, none if it is damaged. Raises KbotError: the file was
        removed."""
        at = index.chunk_start_offset
        if at in self._lost:
            return []
        try:
            with Path(self._path).open("rb") as stream:
                found = chunk_records(chunk_at(stream, at), at, allowance)
        except OSError as error:
            raise KbotError(f"{self._path} cannot be read: {error.strerror or error}") from None
        except RecordingTooLarge as error:
            raise KbotError(f"{self._path}: {error}") from None
        except Damaged:
            self._lost.add(at)
            return []
        return [self._entry(r) for r in found if isinstance(r, Message) and r.channel_id in self._channels]

    def _entry(self, record: Message) -> RecordedMessage:
        topic, type_name, encoding = self._channels[record.channel_id]
        return RecordedMessage(
            topic,
            type_name,
            record.log_time,
            record.data,
            self._types,
            is_ros1=encoding == "ros1",
            qos=self._qos[record.channel_id],
        )

    def _shown(self) -> Iterator[str]:
        yield counted(len(self.topics), "topic")


def _offsets(places: Iterable[MetadataIndex]) -> Iterable[int]:
    """The offsets of metadata, each once: a small index may name a large record many times."""
    return dict.fromkeys(place.offset for place in places)


def _notes(
    stream: IO[bytes], places: Iterable[MetadataIndex], allowance: Allowance
) -> Iterator[tuple[str, dict[str, str]]]:
    for offset in _offsets(places):
        try:
            found = record_at(stream, offset, Opcode.METADATA, allowance)
        except Damaged:
            continue
        if isinstance(found, Metadata):
            yield found.name, dict(found.metadata)
