"""Bags of ROS 1 without their index, as a kill leaves them: record after record, as far as they are whole.

https://wiki.ros.org/Bags/Format/2.0
"""

from __future__ import annotations

from collections.abc import Iterator
from io import BytesIO
from pathlib import Path
from typing import BinaryIO

from rosbags.rosbag1.reader import Header, RecordType, decompressors

from kbot.record.entry import Entry, Types

_LENGTH = 4
"""Bytes of a length."""


class _Ended(Exception):
    """The bytes end, or are no records from here on."""


def salvaged(path: Path, unreadable: tuple[type[Exception], ...]) -> Iterator[Entry]:
    """Every whole message in the order it was written, also those of a chunk that breaks off: one that rosbag
    did not finish says that it is empty, and its records follow. `unreadable` is what reading damaged records
    raises.
    """
    types = Types()
    connections: dict[int, tuple[str, str]] = {}
    with path.open("rb") as stream:
        stream.readline()
        try:
            yield from _records(stream, connections, types, unreadable)
        except _Ended:
            return


def _records(
    stream: BinaryIO,
    connections: dict[int, tuple[str, str]],
    types: Types,
    unreadable: tuple[type[Exception], ...],
) -> Iterator[Entry]:
    while True:
        try:
            header = Header.read(stream)
            kind = header.get_uint8("op")
            data = _data(stream, is_chunk=kind == RecordType.CHUNK)
            found = _Record(header, kind, data).inside(connections, types)
        except unreadable:
            raise _Ended from None
        if isinstance(found, Entry):
            yield found
        elif found is not None:
            try:
                yield from _records(found, connections, types, unreadable)
            except _Ended:
                continue  # the chunk is at its end


def _data(stream: BinaryIO, *, is_chunk: bool) -> bytes:
    """What follows a header, as much as there is of a chunk."""
    told = stream.read(_LENGTH)
    size = int.from_bytes(told, "little")
    data = stream.read(size)
    if len(told) < _LENGTH or (len(data) < size and not is_chunk):
        raise _Ended
    return data


class _Record:
    def __init__(self, header: Header, kind: int, data: bytes) -> None:
        self._header, self._kind, self._data = header, kind, data

    def inside(self, connections: dict[int, tuple[str, str]], types: Types) -> Entry | BinaryIO | None:
        """A message, the records of a chunk, or nothing."""
        header = self._header
        match self._kind:
            case RecordType.CHUNK:
                return BytesIO(decompressors[header.get_string("compression")](self._data))
            case RecordType.CONNECTION:
                told = Header.read(BytesIO(len(self._data).to_bytes(_LENGTH, "little") + self._data))
                package, _, name = told.get_string("type").partition("/")
                type_name = f"{package}/msg/{name}"
                types.learn(type_name, told.get_string("message_definition"))
                connections[header.get_uint32("conn")] = header.get_string("topic"), type_name
            case RecordType.MSGDATA:
                topic, type_name = connections[header.get_uint32("conn")]
                return Entry(topic, type_name, header.get_time("time"), self._data, types, is_ros1=True)
        return None
