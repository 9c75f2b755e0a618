"""Writes ROS 1 bags, version 2.0."""

from __future__ import annotations

import json
from shutil import copyfileobj
from tempfile import SpooledTemporaryFile
from typing import TYPE_CHECKING, BinaryIO, cast
from weakref import finalize

from rosbags.rosbag1.reader import RecordType
from rosbags.rosbag1.writer import Header, WriteChunk, Writer, serialize_uint32

from kbot.messages.types import String
from kbot.record.feed import Packet
from kbot.record.formats import FIRST_TIME, INDEX_BYTES, NOTES_TOPIC, Recordable

if TYPE_CHECKING:
    from rosbags.interfaces import Connection


_HEADER_AT = 13
"""Offset of the bag's header, after the line with the version."""
_HEADER_BYTES = 4096
"""Size of the bag's header with its padding, in which it is written again at the end."""


class _Bag(Writer):
    """The writer of the rosbags library in memory that does not grow with the bag.

    The library keeps the time and the offset of every message until the end, 160 MB for an hour of a robot
    with a lidar. It needs them only for the index of their chunk, and then their number.
    """

    def open(self) -> None:
        super().open()
        # open until the bag is closed
        self._chunk_infos = cast(BinaryIO, SpooledTemporaryFile(INDEX_BYTES))  # noqa: SIM115
        finalize(self, self._chunk_infos.close)  # also if the recording is never finished
        self._count = 0

    def write_chunk(self, chunk: WriteChunk) -> None:
        super().write_chunk(chunk)
        if chunk.pos < 0:
            return  # it is empty
        header = Header()
        header.set_uint32("ver", 1)
        header.set_uint64("chunk_pos", chunk.pos)
        # a chunk with connections only has no times
        header.set_time("start_time", min(chunk.start, chunk.end))
        header.set_time("end_time", chunk.end)
        header.set_uint32("count", len(chunk.connections))
        header.write(self._chunk_infos, RecordType.CHUNK_INFO)
        self._chunk_infos.write(serialize_uint32(8 * len(chunk.connections)))
        for number, messages in chunk.connections.items():
            self._chunk_infos.write(serialize_uint32(number) + serialize_uint32(len(messages)))
        self._count += 1
        self.chunks = self.chunks[-1:]

    def close(self) -> None:
        """Write the index, and its place into the header."""
        bio = self.bio
        if bio is None:
            return  # it was not opened
        self.write_chunk(self.chunks[-1])
        index_at = bio.tell()
        for connection in self.connections:
            self.write_connection(connection, bio)
        self._chunk_infos.seek(0)
        copyfileobj(self._chunk_infos, bio)
        bio.seek(_HEADER_AT)
        header = Header()
        header.set_uint64("index_pos", index_at)
        header.set_uint32("conn_count", len(self.connections))
        header.set_uint32("chunk_count", self._count)
        padding = _HEADER_BYTES - 4 - header.write(bio, RecordType.BAGHEADER)
        bio.write(serialize_uint32(padding) + b" " * padding)
        self.abandon()

    def abandon(self) -> None:
        """Close the file without an index."""
        if self.bio is not None:
            self._chunk_infos.close()
            self.bio.close()  # last: it fails if the disk is full


class Ros1Writer:
    """Writes chunks, and the index at the end. KBot reads an unfinished bag without its index, other programs
    after `rosbag reindex`.

    The bag is not compressed: ROS cannot read the LZ4 of the rosbags library, and BZ2 is too slow for
    recording.
    """

    def __init__(self, path: str) -> None:
        """Raises OSError: the file exists or cannot be created."""
        self._writer = _Bag(path)
        self._writer.open()
        self._connections: dict[tuple[str, str], Connection] = {}
        self._time = FIRST_TIME

    def write(self, packet: Recordable) -> None:
        key = (packet.topic, packet.type_name)
        data = packet.ros1  # before the connection: a type that ROS 1 cannot read gets none
        connection = self._connections.get(key)
        if connection is None:
            definition, md5 = packet.ros1_definition
            connection = self._connections[key] = self._writer.add_connection(
                packet.topic,
                packet.type_name,
                msgdef=definition,
                md5sum=md5,
                callerid="/kbot",
                latching=int(packet.is_latched),
            )
        self._time = max(FIRST_TIME, packet.nanoseconds)
        self._writer.write(connection, self._time, data)

    def annotate(self, name: str, values: dict[str, str]) -> None:
        text = String(json.dumps({"name": name, **values}))
        self.write(Packet(NOTES_TOPIC, text, self._time, is_latched=True))

    def flush(self) -> None:
        if self._writer.bio:
            self._writer.write_chunk(self._writer.chunks[-1])
            self._writer.bio.flush()

    def close(self) -> None:
        self._writer.close()

    def abandon(self) -> None:
        self._writer.abandon()
