"""Writes MCAP files in memory that does not grow with the file."""

from __future__ import annotations

import os
import zlib
from collections import Counter, defaultdict
from collections.abc import Callable
from importlib.metadata import version
from tempfile import SpooledTemporaryFile
from weakref import finalize

from kbot.record.formats import INDEX_BYTES, Recordable
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
    MessageIndex,
    Metadata,
    MetadataIndex,
    Opcode,
    Schema,
    Statistics,
    SummaryOffset,
)

CHUNK_BYTES = 256 * 1024
"""Uncompressed bytes after which a chunk ends."""
_SEQUENCE_NUMBERS = 1 << 32


class UnbufferedFile:
    """A file that is written without a buffer, so that written data survives a crash of the process. A write
    that fails is undone, so the file never ends with a part of a record."""

    def __init__(self, path: str) -> None:
        """Raises OSError: the file exists, or cannot be created."""
        self._descriptor = os.open(
            path, os.O_WRONLY | os.O_CREAT | os.O_EXCL | getattr(os, "O_BINARY", 0), 0o666
        )
        self._end = 0

    def write(self, data: bytes) -> int:
        """Append the data. If it raises OSError, the file is unchanged."""
        view = memoryview(data)
        try:
            while view:
                view = view[os.write(self._descriptor, view) :]
        except OSError:
            os.ftruncate(self._descriptor, self._end)
            raise
        self._end += len(data)
        return len(data)

    def tell(self) -> int:
        return self._end

    def close(self) -> None:
        os.close(self._descriptor)


class McapWriter:
    """Writes whole chunks only, so that after a crash the file is readable up to its last chunk.

    A recorder ends a chunk twice a second. The writer of the mcap library keeps the index of every chunk in
    memory, as objects. This one keeps it in a temporary file, because a run may take days.
    """

    def __init__(self, path: str, *, compress: bool = True) -> None:
        """Raises OSError: the file exists or cannot be created."""
        self._file = UnbufferedFile(path)
        self._file.write(MAGIC + _encoded(Header("ros2", f"kbot {version('kbot')}")))
        self._compression = ""
        self._compress: Callable[[bytearray], bytes] = bytes
        if compress:
            from kbot.record import zstd  # imported lazily: not every recording is compressed

            self._compression = "zstd"
            self._compress = zstd.compress
        self._channels: dict[tuple[str, str], Channel] = {}
        self._schemas: dict[str, Schema] = {}
        self._count = 0
        self._counts: Counter[int] = Counter()
        """Messages in total, and of each channel."""
        self._start, self._end = 0, 0
        """The earliest and the latest time of a message."""
        self._chunk = bytearray()
        """The records of the chunk in progress."""
        self._messages: defaultdict[int, list[tuple[int, int]]] = defaultdict(list)
        """The time of each message in the chunk, and its offset there, by channel."""
        self._chunks = 0
        self._chunk_index = SpooledTemporaryFile(INDEX_BYTES)  # noqa: SIM115 - open until `close`
        finalize(self, self._chunk_index.close)  # also if the recording is never finished
        self._metadata_index: list[MetadataIndex] = []

    def write(self, packet: Recordable) -> None:
        channel = self._channels.get((packet.topic, packet.type_name)) or self._new_channel(packet)
        data, time, number = packet.cdr, packet.nanoseconds, channel.id
        self._start = min(self._start, time) if self._count else time
        self._end = max(self._end, time)
        self._count += 1
        self._counts[number] += 1
        self._messages[number].append((time, len(self._chunk)))
        self._chunk += HEAD.pack(Opcode.MESSAGE, MESSAGE.size + len(data))
        self._chunk += MESSAGE.pack(number, self._count % _SEQUENCE_NUMBERS, time, time)
        self._chunk += data
        if len(self._chunk) > CHUNK_BYTES:
            self.flush()

    def annotate(self, name: str, values: dict[str, str]) -> None:
        data = _encoded(Metadata(name, values))
        self._metadata_index.append(MetadataIndex(self._file.tell(), len(data), name))
        self._file.write(data)

    def flush(self) -> None:
        """End the chunk in progress. One without messages continues."""
        if not self._messages:
            return
        times = [time for entries in self._messages.values() for time, _ in entries]
        packed, start, end = self._compress(self._chunk), min(times), max(times)
        chunk = Chunk(start, end, len(self._chunk), zlib.crc32(self._chunk), self._compression, packed)
        at, record = self._file.tell(), _encoded(chunk)
        parts, offsets, next_at = [record], {}, at + len(record)
        for channel, entries in self._messages.items():
            parts.append(_encoded(MessageIndex(channel, entries)))
            offsets[channel], next_at = next_at, next_at + len(parts[-1])
        self._file.write(b"".join(parts))
        index = ChunkIndex(
            chunk_length=len(record),
            chunk_start_offset=at,
            compression=self._compression,
            compressed_size=len(packed),
            message_end_time=end,
            message_index_length=next_at - at - len(record),
            message_index_offsets=offsets,
            message_start_time=start,
            uncompressed_size=len(self._chunk),
        )
        self._chunk_index.write(_encoded(index))
        self._chunks += 1
        self._chunk.clear()
        self._messages.clear()

    def close(self) -> None:
        self.flush()
        self._file.write(_encoded(DataEnd(0)))
        self._chunk_index.seek(0)
        groups = {
            Opcode.SCHEMA: _encoded(*self._schemas.values()),
            Opcode.CHANNEL: _encoded(*self._channels.values()),
            Opcode.STATISTICS: _encoded(self._statistics()),
            Opcode.CHUNK_INDEX: self._chunk_index.read(),
            Opcode.METADATA_INDEX: _encoded(*self._metadata_index),
        }
        start = at = self._file.tell()
        offsets = []
        for kind, data in groups.items():
            offsets.append(SummaryOffset(kind, at, len(data)))
            at += len(data)
        summary = b"".join(groups.values()) + _encoded(*offsets)
        # the checksum covers the footer up to itself, its last 4 bytes
        checked = summary + _encoded(Footer(start, at, 0))[:-4]
        self._file.write(summary + _encoded(Footer(start, at, zlib.crc32(checked))) + MAGIC)
        self.abandon()

    def abandon(self) -> None:
        self._chunk_index.close()
        self._file.close()

    def _new_channel(self, packet: Recordable) -> Channel:
        topic, type_name = packet.topic, packet.type_name
        schema = self._schemas.get(type_name)
        if schema is None:
            text = packet.ros2_definition[0].encode()
            schema = Schema(len(self._schemas) + 1, type_name, "ros2msg", text)
            self._schemas[type_name] = schema
            self._chunk += _encoded(schema)
        qos = {"offered_qos_profiles": packet.offered_qos}
        channel = Channel(len(self._channels) + 1, schema.id, topic, "cdr", qos)
        self._channels[topic, type_name] = channel
        self._chunk += _encoded(channel)
        return channel

    def _statistics(self) -> Statistics:
        return Statistics(
            attachment_count=0,
            channel_count=len(self._channels),
            channel_message_counts=dict(self._counts),
            chunk_count=self._chunks,
            message_count=self._count,
            message_end_time=self._end,
            message_start_time=self._start,
            metadata_count=len(self._metadata_index),
            schema_count=len(self._schemas),
        )


def _encoded(*records: McapRecord) -> bytes:
    return b"".join(record.encoded() for record in records)
