"""The records of an MCAP file, as its specification defines them: https://mcap.dev/spec

The library `mcap` installs zstandard, whose two copies of the same library take 24 MB. The tests compare
these records with those of `mcap`.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, fields
from enum import IntEnum, unique
from struct import Struct
from typing import Any, ClassVar, Protocol, Self

MAGIC = b"\x89MCAP0\r\n"
HEAD = Struct("<BQ")
"""The head of a record: its opcode, and the length of its content."""


@unique
class Opcode(IntEnum):
    HEADER = 0x01
    FOOTER = 0x02
    SCHEMA = 0x03
    CHANNEL = 0x04
    MESSAGE = 0x05
    CHUNK = 0x06
    MESSAGE_INDEX = 0x07
    CHUNK_INDEX = 0x08
    STATISTICS = 0x0B
    METADATA = 0x0C
    METADATA_INDEX = 0x0D
    SUMMARY_OFFSET = 0x0E
    DATA_END = 0x0F


MESSAGE = Struct("<HIQQ")
"""What a message has before its data: channel, sequence, log time and publish time. There are many messages,
so they are read and written without `McapRecord`."""


class _Cursor:
    """Reads bytes one part after the other."""

    def __init__(self, data: bytes) -> None:
        self._data, self._at = data, 0

    def take(self, count: int) -> bytes:
        """The next bytes. Raises ValueError: fewer are left."""
        found = self._data[self._at : self._at + count]
        if len(found) < count:
            raise ValueError(f"a field should have {count:,} bytes, but only {len(found):,} are left")
        self._at += count
        return found

    def rest(self) -> bytes:
        return self.take(len(self._data) - self._at)

    @property
    def is_at_end(self) -> bool:
        return self._at == len(self._data)


class _Kind(Protocol):
    """How a field is encoded. `read` raises ValueError: the bytes are not such a field."""

    def read(self, cursor: _Cursor) -> Any: ...  # noqa: ANN401 - the type of the field

    def encoded(self, value: Any) -> bytes: ...  # noqa: ANN401


class _Number:
    def __init__(self, code: str) -> None:
        self._struct = Struct(f"<{code}")

    def read(self, cursor: _Cursor) -> int:
        (found,) = self._struct.unpack(cursor.take(self._struct.size))
        return int(found)

    def encoded(self, value: int) -> bytes:
        return self._struct.pack(value)


class _Bytes:
    """Bytes after their number."""

    def __init__(self, count: _Number) -> None:
        self._count = count

    def read(self, cursor: _Cursor) -> bytes:
        return cursor.take(self._count.read(cursor))

    def encoded(self, value: bytes) -> bytes:
        return self._count.encoded(len(value)) + value


U8, U16, U32, U64 = map(_Number, "BHIQ")
BYTES, LONG_BYTES = _Bytes(U32), _Bytes(U64)


class _Text:
    def read(self, cursor: _Cursor) -> str:
        return str(BYTES.read(cursor), "utf-8")

    def encoded(self, value: str) -> bytes:
        return BYTES.encoded(value.encode())


class _Rest:
    """All bytes up to the end of the record."""

    def read(self, cursor: _Cursor) -> bytes:
        return cursor.rest()

    def encoded(self, value: bytes) -> bytes:
        return value


_MOST_PAIRS = 1 << 16
"""Entries of a map. The largest maps have one for each channel, and the number of a channel has 16 bits."""


class _Pairs:
    def __init__(self, first: _Kind, second: _Kind) -> None:
        self._first, self._second = first, second

    def read(self, cursor: _Cursor) -> list[tuple[Any, Any]]:
        part = _Cursor(BYTES.read(cursor))
        found: list[tuple[Any, Any]] = []
        while not part.is_at_end:
            if len(found) == _MOST_PAIRS:
                raise ValueError(f"a map has more than {_MOST_PAIRS:,} entries")
            found.append((self._first.read(part), self._second.read(part)))
        return found

    def encoded(self, value: Iterable[tuple[object, object]]) -> bytes:
        first, second = self._first.encoded, self._second.encoded
        return BYTES.encoded(b"".join(first(a) + second(b) for a, b in value))


class _Map:
    def __init__(self, key: _Kind, value: _Kind) -> None:
        self._pairs = _Pairs(key, value)

    def read(self, cursor: _Cursor) -> dict[Any, Any]:
        return dict(self._pairs.read(cursor))

    def encoded(self, value: Mapping[object, object]) -> bytes:
        return self._pairs.encoded(value.items())


TEXT = _Text()


@dataclass(slots=True)
class McapRecord:
    """A record. Its fields are in the order of the file. Times are in nanoseconds."""

    OPCODE: ClassVar[Opcode]
    KINDS: ClassVar[tuple[_Kind, ...]] = ()
    """How each field is encoded."""

    @classmethod
    def read(cls, data: bytes) -> Self:
        """The record with this content. Bytes after the last field are allowed: a later version of the format
        may add fields. Raises ValueError: the content does not follow the format."""
        cursor = _Cursor(data)
        return cls(*(kind.read(cursor) for kind in cls.KINDS))

    def encoded(self) -> bytes:
        """The record with its head."""
        values = (getattr(self, field.name) for field in fields(self))
        content = b"".join(kind.encoded(value) for kind, value in zip(self.KINDS, values, strict=True))
        return HEAD.pack(self.OPCODE, len(content)) + content


@dataclass(slots=True)
class Header(McapRecord):
    OPCODE = Opcode.HEADER
    KINDS = (TEXT, TEXT)
    profile: str
    library: str


@dataclass(slots=True)
class Footer(McapRecord):
    """`summary_crc` is over the summary section and this record up to it."""

    OPCODE = Opcode.FOOTER
    KINDS = (U64, U64, U32)
    summary_start: int
    summary_offset_start: int
    summary_crc: int


@dataclass(slots=True)
class Schema(McapRecord):
    OPCODE = Opcode.SCHEMA
    KINDS = (U16, TEXT, TEXT, BYTES)
    id: int
    name: str
    encoding: str
    data: bytes


@dataclass(slots=True)
class Channel(McapRecord):
    OPCODE = Opcode.CHANNEL
    KINDS = (U16, U16, TEXT, TEXT, _Map(TEXT, TEXT))
    id: int
    schema_id: int
    topic: str
    message_encoding: str
    metadata: dict[str, str]


@dataclass(slots=True)
class Message(McapRecord):
    """KBot reads and writes it by `MESSAGE`. Only the tests use `KINDS`, to compare it with `mcap`."""

    OPCODE = Opcode.MESSAGE
    KINDS = (U16, U32, U64, U64, _Rest())
    channel_id: int
    sequence: int
    log_time: int
    publish_time: int
    data: bytes


@dataclass(slots=True)
class Chunk(McapRecord):
    OPCODE = Opcode.CHUNK
    KINDS = (U64, U64, U64, U32, TEXT, LONG_BYTES)
    message_start_time: int
    message_end_time: int
    uncompressed_size: int
    uncompressed_crc: int
    compression: str
    data: bytes


@dataclass(slots=True)
class MessageIndex(McapRecord):
    """The log time and the offset in its chunk of each message of a channel."""

    OPCODE = Opcode.MESSAGE_INDEX
    KINDS = (U16, _Pairs(U64, U64))
    channel_id: int
    records: list[tuple[int, int]]


@dataclass(slots=True)
class ChunkIndex(McapRecord):
    OPCODE = Opcode.CHUNK_INDEX
    KINDS = (U64, U64, U64, U64, _Map(U16, U64), U64, TEXT, U64, U64)
    message_start_time: int
    message_end_time: int
    chunk_start_offset: int
    chunk_length: int
    message_index_offsets: dict[int, int]
    message_index_length: int
    compression: str
    compressed_size: int
    uncompressed_size: int


@dataclass(slots=True)
class Statistics(McapRecord):
    OPCODE = Opcode.STATISTICS
    KINDS = (U64, U16, U32, U32, U32, U32, U64, U64, _Map(U16, U64))
    message_count: int
    schema_count: int
    channel_count: int
    attachment_count: int
    metadata_count: int
    chunk_count: int
    message_start_time: int
    message_end_time: int
    channel_message_counts: dict[int, int]


@dataclass(slots=True)
class Metadata(McapRecord):
    OPCODE = Opcode.METADATA
    KINDS = (TEXT, _Map(TEXT, TEXT))
    name: str
    metadata: dict[str, str]


@dataclass(slots=True)
class MetadataIndex(McapRecord):
    OPCODE = Opcode.METADATA_INDEX
    KINDS = (U64, U64, TEXT)
    offset: int
    length: int
    name: str


@dataclass(slots=True)
class SummaryOffset(McapRecord):
    OPCODE = Opcode.SUMMARY_OFFSET
    KINDS = (U8, U64, U64)
    group_opcode: int
    group_start: int
    group_length: int


@dataclass(slots=True)
class DataEnd(McapRecord):
    OPCODE = Opcode.DATA_END
    KINDS = (U32,)
    data_section_crc: int
