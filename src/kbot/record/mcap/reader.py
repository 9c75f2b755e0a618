"""MCAP files, read from front to back: a file that was never closed, or is damaged, gives all its whole
chunks."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import suppress
from pathlib import Path
from struct import error as StructError
from typing import IO

from mcap.data_stream import ReadDataStream
from mcap.exceptions import McapError
from mcap.reader import make_reader
from mcap.records import Channel, Chunk, McapRecord, Message, Metadata, Schema
from mcap.stream_reader import StreamReader, breakup_chunk

from kbot.record.entry import Entry, Types
from kbot.record.formats import BrokenOff, Note
from kbot.text import KbotError

LARGEST_RECORD = 1 << 30
RECORD_HEAD = 1 + 8
"""Bytes of a record's opcode and length, which stand before it."""
CARRIED = ("cdr", "ros1")
"""Encodings of messages that are read."""


class McapSource:
    """Messages in CDR or in ROS 1's encoding; others are skipped."""

    kind = "MCAP"

    def __init__(self, path: str) -> None:
        self._path = path

    def entries(self, note: Note) -> Iterator[Entry]:
        """Raises BrokenOff, KbotError: see `Source`."""
        types, schemas, channels = Types(), dict[int, Schema](), dict[int, Channel]()
        for record in self._records():
            match record:
                case Schema():
                    schemas[record.id] = record
                    if record.encoding in ("ros2msg", "ros1msg"):
                        types.learn(full_name(record.name), record.data.decode(errors="replace"))
                case Channel():
                    channels[record.id] = record
                case Metadata():
                    note(record.name, dict(record.metadata))
                case Message():
                    channel = channels.get(record.channel_id)
                    schema = schemas.get(channel.schema_id) if channel is not None else None
                    if channel is None or schema is None or channel.message_encoding not in CARRIED:
                        continue
                    is_ros1 = channel.message_encoding == "ros1"
                    name = full_name(schema.name)
                    yield Entry(channel.topic, name, record.log_time, record.data, types, is_ros1=is_ros1)

    def _records(self) -> Iterator[McapRecord]:
        """Those in chunks too, which are whole or left out."""
        started, chunks = False, 0
        faults = unreadable()
        with Path(self._path).open("rb") as stream:
            reader = StreamReader(
                stream, emit_chunks=True, validate_crcs=True, record_size_limit=LARGEST_RECORD
            )
            records = reader.records
            while True:
                try:
                    record = next(records)
                    within = [record]
                    if isinstance(record, Chunk):
                        within = breakup_chunk(record, validate_crc=True)
                        chunks += 1
                except StopIteration:
                    return
                except faults as error:
                    if not started:
                        told = str(error) if isinstance(error, McapError) else ""
                        why = told or "it ends before its first record"
                        raise KbotError(f"{self._path} is no MCAP file: {why}") from None
                    break
                started = True
                yield from within
            yield from self._rest(stream, chunks)

    def _rest(self, stream: IO[bytes], chunks: int) -> Iterator[McapRecord]:
        """What the index knows after so many chunks that are whole. Raises BrokenOff, at the end."""
        faults = unreadable()
        try:
            stream.seek(0)
            summary = make_reader(stream).get_summary()
        except faults:
            summary = None
        if summary is None:
            raise BrokenOff("it was not closed: what follows its last whole chunk is lost")
        yield from (*summary.schemas.values(), *summary.channels.values())
        in_file = sorted(index.chunk_start_offset for index in summary.chunk_indexes)
        lost = 0
        for offset in in_file[chunks:]:
            try:
                stream.seek(offset + RECORD_HEAD)
                within = breakup_chunk(Chunk.read(ReadDataStream(stream)), validate_crc=True)
            except faults:
                lost += 1
                continue
            yield from within
        for index in summary.metadata_indexes:
            stream.seek(index.offset + RECORD_HEAD)
            with suppress(*faults):
                yield Metadata.read(ReadDataStream(stream))
        raise BrokenOff(f"it is damaged: {lost} of its {len(in_file)} chunks cannot be read")


def full_name(name: str) -> str:
    """A type as ROS 2 writes it, `std_msgs/msg/String`, of either writing."""
    package, _, rest = name.partition("/")
    return f"{package}/msg/{rest.removeprefix('msg/')}"


def unreadable() -> tuple[type[Exception], ...]:
    """What reading raises where a file is no MCAP, or broken."""
    import zstandard

    return (McapError, EOFError, StructError, ValueError, RuntimeError, zstandard.ZstdError)
