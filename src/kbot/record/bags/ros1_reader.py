"""Reads ROS 1 bags, version 2.0. https://wiki.ros.org/Bags/Format/2.0

Every length is checked against the remaining bytes before it is used.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator
from io import SEEK_END, BytesIO
from pathlib import Path
from struct import Struct
from struct import error as StructError
from typing import IO, NamedTuple

from rosbags.rosbag1 import ReaderError
from rosbags.rosbag1.reader import Header, RecordType

from kbot.record.encodings.foreign_types import full_name
from kbot.record.encodings.quality import latches, offered_qos
from kbot.record.entry import RecordedMessage, Types
from kbot.record.formats import NoIndex
from kbot.record.limits import Allowance, Damaged, RecordingTooLarge, check_length, check_names, inflate
from kbot.text import KbotError

_MAGIC = b"#ROSBAG V2.0\n"
_LENGTH = Struct("<I")
_COUNT = Struct("<II")
_LARGEST_HEADER = 1 << 20
"""Bytes. Headers contain a few numbers and a topic name."""


class Chunk(NamedTuple):
    """An index entry of a chunk: its offset, first and last time, and number of messages by connection."""

    at: int
    start: int
    end: int
    counts: dict[int, int]


class _Record(NamedTuple):
    at: int
    header: Header
    kind: int
    data_at: int
    size: int
    left: int
    """Bytes from its data to the end of the file or chunk."""


class Ros1Bag:
    """One file. `connections` are topics and types by connection number. They are known after `read_index`,
    or after their records are read."""

    def __init__(self, path: str | Path, allowance: Allowance | None = None) -> None:
        """Converted messages are charged to `allowance`, if given."""
        self._path = Path(path)
        self.types = Types(path, allowance)
        self.connections: dict[int, tuple[str, str]] = {}
        self._qos: dict[int, str] = {}
        """The quality of service by connection number, for latched topics."""
        self.chunks: list[Chunk] = []

    @property
    def latched(self) -> set[str]:
        """The known topics that kept their last message for late subscribers."""
        return {
            topic
            for number, (topic, _) in self.connections.items()
            if latches(topic, self._qos.get(number, ""))
        }

    def read_index(self) -> None:
        """Read the connections, and the chunks sorted by first time.

        Raises:
            NoIndex: the file ends before its index.
            KbotError: it is damaged, or not a ROS 1 bag.
        """
        try:
            with self._path.open("rb") as stream:
                size = stream.seek(0, SEEK_END)
                self._read_index(stream, size)
        except (Damaged, ReaderError, OSError) as error:
            raise self.unreadable_error(error) from None
        except RecordingTooLarge as error:
            raise KbotError(f"{self._path}: {error}") from None

    def _read_index(self, stream: IO[bytes], size: int) -> None:
        stream.seek(0)
        magic = stream.read(len(_MAGIC))
        if magic != _MAGIC:
            raise Damaged("its first bytes are wrong" if magic else "it is empty")
        first = next(_records(stream, len(_MAGIC), size), None)
        if first is None:
            raise Damaged("it ends before its first record")
        header = first.header
        at = header.get_uint64("index_pos")
        if header.get("encryptor"):
            raise Damaged("it is encrypted")
        if at == 0:
            raise NoIndex(f"it was not closed, so its {size:,} bytes have no index")
        if size < at or (size == at and header.get_uint32("chunk_count")):
            raise NoIndex(f"it ends after {size:,} bytes, before its index at {at:,}")
        for record in _records(stream, at, size):
            match record.kind:
                case RecordType.CONNECTION:
                    self._connect(record, _data(stream, record))
                case RecordType.CHUNK_INFO:
                    self.chunks.append(_chunk(record.header, _data(stream, record)))
                case _:
                    raise Damaged(f"its index contains a record of the wrong kind at byte {record.at:,}")
        for name, found in (("conn_count", len(self.connections)), ("chunk_count", len(self.chunks))):
            if header.get_uint32(name) != found:
                raise Damaged(f"its index has {found} entries, but {name} is {header.get_uint32(name)}")
        if len({chunk.at for chunk in self.chunks}) < len(self.chunks):
            raise Damaged("its index lists a chunk twice")
        self.chunks.sort(key=lambda chunk: chunk.start)

    def messages(self, chunk: Chunk, allowance: Allowance) -> list[RecordedMessage]:
        """The messages of a chunk. Raises KbotError: it is damaged, or too large."""
        try:
            with self._path.open("rb") as stream:
                size = stream.seek(0, SEEK_END)
                record = next(_records(stream, chunk.at, size), None)
                if record is None or record.kind != RecordType.CHUNK:
                    raise Damaged(f"there is no chunk at byte {chunk.at:,}")
                data = self._inflated(stream, record, allowance)
            counts: Counter[int] = Counter()
            entries = []
            for number, entry in self._within(data, allowance):
                counts[number] += 1
                entries.append(entry)
            if counts != Counter(chunk.counts):
                raise Damaged(f"the messages of the chunk at byte {chunk.at:,} do not match its index")
        except (Damaged, ReaderError, OSError) as error:
            raise self.unreadable_error(error) from None
        except RecordingTooLarge as error:
            raise KbotError(f"{self._path}: {error}") from None
        return entries

    def readable_messages(self, allowance: Allowance) -> Iterator[RecordedMessage]:
        """Every complete message in the order it was written, without the index.

        This includes messages of an unfinished chunk. rosbag writes the size 0 for such a chunk, and its
        records follow.
        """
        with self._path.open("rb") as stream:
            size = stream.seek(0, SEEK_END)
            try:
                for record in _records(stream, len(_MAGIC), size):
                    if record.kind == RecordType.CHUNK:
                        yield from self._complete_messages(
                            self._inflated(stream, record, allowance), allowance
                        )
                    elif (found := self._read(stream, record)) is not None:
                        yield found[1]
            except (Damaged, ReaderError):
                return
            except RecordingTooLarge as error:
                raise KbotError(f"{self._path}: {error}") from None

    def _complete_messages(self, data: bytes, allowance: Allowance) -> Iterator[RecordedMessage]:
        try:
            for _, entry in self._within(data, allowance):
                yield entry
        except (Damaged, ReaderError):
            return

    def _within(self, data: bytes, allowance: Allowance) -> Iterator[tuple[int, RecordedMessage]]:
        """The messages of a chunk's data, with the numbers of their connections."""
        stream = BytesIO(data)
        for record in _records(stream, 0, len(data)):
            allowance.charge(records=1)
            found = self._read(stream, record)
            if found is not None:
                yield found

    def _read(self, stream: IO[bytes], record: _Record) -> tuple[int, RecordedMessage] | None:
        """A message with the number of its connection; None for any other record."""
        match record.kind:
            case RecordType.CONNECTION:
                self._connect(record, _data(stream, record))
            case RecordType.MSGDATA:
                number = record.header.get_uint32("conn")
                if number not in self.connections:
                    raise Damaged(f"a message refers to connection {number}, which does not exist")
                at, data = record.header.get_time("time"), _data(stream, record)
                topic, name = self.connections[number]
                qos = self._qos.get(number, "")
                return number, RecordedMessage(topic, name, at, data, self.types, is_ros1=True, qos=qos)
        return None

    def _connect(self, record: _Record, data: bytes) -> None:
        """Add a connection. A known number is not changed."""
        number = record.header.get_uint32("conn")
        if number in self.connections:
            return
        fields = _header(data, record.at)
        topic = record.header.get_string("topic")
        check_names(topic)
        name = full_name(fields.get_string("type"))
        if fields.get("latching") == b"1":
            self._qos[number] = offered_qos(True)
        self.types.learn(name, fields.get_string("message_definition"))
        # ROS resolves topic names in this way
        root = "/" if topic.startswith("/") else ""
        self.connections[number] = root + "/".join(filter(None, topic.split("/"))), name

    def _inflated(self, stream: IO[bytes], record: _Record, allowance: Allowance) -> bytes:
        """The decompressed data of a chunk. If the file ends inside it, the data up to there."""
        compression, stated = record.header.get_string("compression"), record.header.get_uint32("size")
        if record.size == stated == 0:
            return b""  # the chunk is not finished
        is_cut = record.size > record.left
        try:
            data = stream.read(record.left) if is_cut else _data(stream, record)
            found = inflate(data, compression, len(data) if is_cut and compression == "none" else stated)
        except ValueError as error:
            raise Damaged(f"the chunk at byte {record.at:,} is damaged: {error}") from None
        except RecordingTooLarge as error:
            raise RecordingTooLarge(f"the chunk at byte {record.at:,} is not read: {error}") from None
        allowance.charge(len(found), compression=compression)
        return found

    def unreadable_error(self, error: Exception) -> KbotError:
        """The error for a bag that cannot be read because of another error."""
        return KbotError(
            f"{self._path} cannot be read as a ROS 1 bag: {error}; on a machine with ROS 1, "
            f"rosbag reindex {self._path} recovers the complete messages"
        )


def _records(stream: IO[bytes], start: int, end: int) -> Iterator[_Record]:
    """The records between two offsets of a stream. The stream is then at the record's data. The last record
    may be incomplete."""
    at = start
    while at < end:
        stream.seek(at)
        size = _length(stream, at)
        left = end - at - 2 * _LENGTH.size
        if size > min(left, _LARGEST_HEADER):
            raise Damaged(f"the record at byte {at:,} has an impossible header length of {size:,} bytes")
        header = _header(stream.read(size), at)
        data_at = at + 2 * _LENGTH.size + size
        length = _length(stream, at)
        yield _Record(at, header, header.get_uint8("op"), data_at, length, end - data_at)
        at = data_at + length


def _length(stream: IO[bytes], at: int) -> int:
    data = stream.read(_LENGTH.size)
    if len(data) < _LENGTH.size:
        raise Damaged(f"it ends in the middle of the record at byte {at:,}")
    return int(_LENGTH.unpack(data)[0])


def _header(data: bytes, at: int) -> Header:
    try:
        return Header.read(BytesIO(_LENGTH.pack(len(data)) + data))
    except (ReaderError, ValueError) as error:
        raise Damaged(f"the header at byte {at:,} is damaged: {error}") from None


def _data(stream: IO[bytes], record: _Record) -> bytes:
    check_length(record.at, record.size, max(record.left, 0))
    stream.seek(record.data_at)
    return stream.read(record.size)


def _chunk(header: Header, data: bytes) -> Chunk:
    if header.get_uint32("ver") != 1:
        raise Damaged(f"its index has the unknown version {header.get_uint32('ver')}")
    at, count = header.get_uint64("chunk_pos"), header.get_uint32("count")
    if len(data) != count * _COUNT.size:
        raise Damaged(f"its index has {len(data)} bytes, the wrong size for {count} connections")
    try:
        counts = dict(_COUNT.iter_unpack(data))
    except StructError as error:
        raise Damaged(str(error)) from None
    # an empty chunk has no times
    return (
        Chunk(at, header.get_time("start_time"), header.get_time("end_time"), counts)
        if count
        else Chunk(at, 0, 0, {})
    )
