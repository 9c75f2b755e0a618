"""The records of an MCAP file. https://mcap.dev/spec

Every length is checked against the bytes that are left before anything is read by it.
"""

from __future__ import annotations

import zlib
from collections.abc import Collection, Iterator
from io import SEEK_END, BytesIO
from struct import Struct
from struct import error as StructError
from typing import IO, Any

from mcap.data_stream import ReadDataStream
from mcap.exceptions import McapError
from mcap.opcode import Opcode
from mcap.records import (
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
    Schema,
    Statistics,
)
from mcap.summary import Summary

from kbot.record.limits import Allowance, Damaged, TooLarge, check_length, inflate

MAGIC = b"\x89MCAP0\r\n"
_HEAD = Struct("<BQ")
_MESSAGE = Struct("<HIQQ")
_CRC_BYTES = 1 << 20
_PARSED: dict[int, Any] = {
    Opcode.CHANNEL: Channel,
    Opcode.CHUNK: Chunk,
    Opcode.CHUNK_INDEX: ChunkIndex,
    Opcode.DATA_END: DataEnd,
    Opcode.FOOTER: Footer,
    Opcode.HEADER: Header,
    Opcode.METADATA: Metadata,
    Opcode.METADATA_INDEX: MetadataIndex,
    Opcode.SCHEMA: Schema,
    Opcode.STATISTICS: Statistics,
}
IN_FILE = (
    *(Opcode.SCHEMA, Opcode.CHANNEL, Opcode.MESSAGE, Opcode.CHUNK, Opcode.METADATA, Opcode.DATA_END),
    *(Opcode.HEADER, Opcode.FOOTER),
)
IN_CHUNK = (Opcode.SCHEMA, Opcode.CHANNEL, Opcode.MESSAGE)
IN_SUMMARY = (
    *(Opcode.SCHEMA, Opcode.CHANNEL, Opcode.CHUNK_INDEX, Opcode.METADATA_INDEX, Opcode.STATISTICS),
    Opcode.FOOTER,
)


def records(
    stream: IO[bytes], start: int, end: int, wanted: Collection[int], allowance: Allowance | None = None
) -> Iterator[tuple[int, McapRecord]]:
    """The records between two places of a stream, each with its place; those not wanted are skipped unread.

    Raises:
        Damaged: a record is.
        OSError: the file cannot be read.
        TooLarge: the allowance is used up, of which each record takes a part.
    """
    at = start
    while at < end:
        if allowance is not None:
            allowance.charge(records=1)
        stream.seek(at)
        head = stream.read(_HEAD.size)
        if len(head) < _HEAD.size:
            raise Damaged(f"it ends within the record at byte {at:,}")
        kind, length = _HEAD.unpack(head)
        left = end - at - _HEAD.size
        check_length(at, length, left, is_skipped=kind not in wanted)
        if kind in wanted:
            yield at, _parsed(stream, kind, length, at)
        at += _HEAD.size + length


def record_at(stream: IO[bytes], at: int, kind: Opcode) -> McapRecord:
    """The record at a place that an index gives. Raises Damaged: no such record is there."""
    end = stream.seek(0, SEEK_END)
    found_at, record = next(records(stream, at, end, (kind,)), (-1, McapRecord()))
    if found_at != at:
        raise Damaged(f"no {kind.name.lower()} is at byte {at:,}")
    return record


def _parsed(stream: IO[bytes], kind: int, length: int, at: int) -> McapRecord:
    try:
        if kind == Opcode.MESSAGE:
            channel, sequence, logged, published = _MESSAGE.unpack(stream.read(min(length, _MESSAGE.size)))
            return Message(channel, logged, stream.read(length - _MESSAGE.size), published, sequence)
        found: McapRecord = _PARSED[kind].read(ReadDataStream(BytesIO(stream.read(length))))
    except (McapError, StructError, ValueError, OverflowError) as error:
        raise Damaged(f"the record at byte {at:,} is damaged: {error}") from None
    return found


def break_up(chunk: Chunk, at: int, allowance: Allowance) -> list[McapRecord]:
    """The records in the chunk at a place.

    Raises:
        Damaged: it is not whole.
        TooLarge: reading it would cost too much.
    """
    try:
        data = inflate(chunk.data, chunk.compression, chunk.uncompressed_size)
    except ValueError as error:
        raise Damaged(f"the chunk at byte {at:,} is damaged: {error}") from None
    except TooLarge as error:
        raise TooLarge(f"the chunk at byte {at:,} is not read: {error}") from None
    allowance.charge(len(data), compression=chunk.compression)
    if chunk.uncompressed_crc not in (0, zlib.crc32(data)):
        raise Damaged(f"the chunk at byte {at:,} has another checksum")
    return [record for _, record in records(BytesIO(data), 0, len(data), IN_CHUNK, allowance)]


def read_summary(stream: IO[bytes]) -> Summary | None:
    """Read the summary section; None if the file has none. Raises Damaged, OSError."""
    end = stream.seek(0, SEEK_END)
    footer_at = end - len(MAGIC) - _HEAD.size - 20
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
    """Raises Damaged: the file up to the record at `end` has another checksum than that record states."""
    if data_end.data_section_crc == 0:
        return
    stream.seek(0)
    crc, left = 0, end
    while left > 0 and (data := stream.read(min(left, _CRC_BYTES))):
        crc, left = zlib.crc32(data, crc), left - len(data)
    if crc != data_end.data_section_crc:
        raise Damaged("its messages have another checksum")
