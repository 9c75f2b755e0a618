"""MCAP files, read from front to back: a file that was never closed, or is damaged, gives all its whole
chunks."""

from __future__ import annotations

from collections.abc import Iterator
from io import SEEK_END
from pathlib import Path
from typing import IO

from mcap.opcode import Opcode
from mcap.records import Channel, Chunk, DataEnd, Footer, McapRecord, Message, Metadata, Schema

from kbot.record.encodings.foreign_types import full_name
from kbot.record.entry import Entry, Types
from kbot.record.formats import BrokenOff, Note
from kbot.record.limits import Allowance, Damaged, TooLarge
from kbot.record.mcap.records import (
    IN_FILE,
    MAGIC,
    break_up,
    check_data,
    read_summary,
    record_at,
    records,
)
from kbot.text import KbotError

CARRIED = ("cdr", "ros1")
"""Encodings of messages that are read."""


class McapSource:
    """Messages in CDR or in ROS 1's encoding; others are skipped."""

    kind = "MCAP"

    def __init__(self, path: str) -> None:
        self._path = path

    def entries(self, note: Note) -> Iterator[Entry]:
        """Raises BrokenOff, KbotError: see `Source`."""
        try:
            yield from self._entries(note, Allowance(self._path))
        except TooLarge as error:
            raise KbotError(f"{self._path}: {error}") from None

    def _entries(self, note: Note, allowance: Allowance) -> Iterator[Entry]:
        types, schemas, channels = Types(self._path, allowance), dict[int, Schema](), dict[int, Channel]()
        for record in self._records(allowance):
            match record:
                case Schema():
                    schemas[record.id] = record
                    learn(types, record)
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

    def _records(self, allowance: Allowance) -> Iterator[McapRecord]:
        """Those in chunks too, which are whole or left out."""
        chunks, is_begun = 0, False
        with Path(self._path).open("rb") as stream:
            size = stream.seek(0, SEEK_END)
            stream.seek(0)
            if stream.read(len(MAGIC)) != MAGIC[:size]:
                raise KbotError(f"{self._path} is not an MCAP file: it does not begin as one")
            try:
                for at, record in records(stream, len(MAGIC), size, IN_FILE):
                    is_begun = True
                    match record:
                        case Chunk():
                            within = break_up(record, at, allowance)
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
        """What the index knows after so many chunks that are whole. Raises BrokenOff, at the end."""
        try:
            summary = read_summary(stream)
        except Damaged:
            summary = None
        if summary is None:
            raise BrokenOff("it was not closed: what follows its last whole chunk is lost")
        yield from (*summary.schemas.values(), *summary.channels.values())
        in_file = sorted({index.chunk_start_offset for index in summary.chunk_indexes})
        lost = 0
        for offset in in_file[chunks:]:
            try:
                within = break_up(chunk_at(stream, offset), offset, allowance)
            except Damaged:
                lost += 1
                continue
            yield from within
        for index in summary.metadata_indexes:
            try:
                yield record_at(stream, index.offset, Opcode.METADATA)
            except Damaged:
                continue
        raise BrokenOff(f"it is damaged: {lost} of its {len(in_file)} chunks cannot be read")


def learn(types: Types, schema: Schema) -> None:
    """Register the type that a ROS schema defines. Raises KbotError: it does not follow ROS's grammar."""
    if schema.encoding in ("ros2msg", "ros1msg"):
        types.learn(full_name(schema.name), schema.data.decode(errors="replace"))


def chunk_at(stream: IO[bytes], offset: int) -> Chunk:
    """Raises Damaged: it is not there."""
    record = record_at(stream, offset, Opcode.CHUNK)
    if not isinstance(record, Chunk):
        raise Damaged(f"no chunk is at byte {offset:,}")
    return record
