"""Recordings that state wrong sizes or decompress to huge ones."""

import bz2
import sqlite3
import struct
from collections.abc import Callable, Mapping
from contextlib import closing
from pathlib import Path

import lz4.frame
import zstandard
from mcap.writer import CompressionType, Writer

TEXT = "std_msgs/msg/String"
WORD = b"\0\1\0\0\2\0\0\0a\0"
"""A String in CDR."""
ROS1_WORD = b"\1\0\0\0a"
BOMB = 1 << 30

PACK: Mapping[str, Callable[[bytes], bytes]] = {
    "zstd": zstandard.ZstdCompressor().compress,
    "lz4": lz4.frame.compress,
    "bz2": bz2.compress,
    "": lambda data: data,
    "none": lambda data: data,
}


def zeros(compression: str, size: int) -> bytes:
    """Compressed zeros, generated without having all of them in memory."""
    piece = bytes(1 << 20)
    count = size // len(piece)
    if compression == "zstd":
        packer = zstandard.ZstdCompressor(write_content_size=False).compressobj()
        return b"".join([*(packer.compress(piece) for _ in range(count)), packer.flush()])
    if compression == "lz4":
        with lz4.frame.LZ4FrameCompressor() as lz:
            return b"".join([lz.begin(), *(lz.compress(piece) for _ in range(count)), lz.flush()])
    bz = bz2.BZ2Compressor()
    return b"".join([*(bz.compress(piece) for _ in range(count)), bz.flush()])


def mcap_record(kind: int, body: bytes) -> bytes:
    return struct.pack("<BQ", kind, len(body)) + body


def mcap_text(text: str) -> bytes:
    data = text.encode()
    return struct.pack("<I", len(data)) + data


def mcap_chunk(data: bytes, compression: str, size: int) -> bytes:
    """A chunk of compressed data with a stated size and without a checksum."""
    head = struct.pack("<QQQI", 0, 1, size, 0)
    return mcap_record(6, head + mcap_text(compression) + struct.pack("<Q", len(data)) + data)


def mcap_file(path: Path, *records: bytes) -> Path:
    """Write records after the magic and the header, with a footer without an index."""
    head = mcap_record(1, mcap_text("ros2") + mcap_text("test"))
    footer = mcap_record(2, bytes(20))
    magic = b"\x89MCAP0\r\n"
    path.write_bytes(b"".join([magic, head, *records, footer, magic]))
    return path


def mcap_of(path: Path, schemas: Mapping[str, str], *, data: bytes = WORD, encoding: str = "cdr") -> Path:
    """Write one message of each type with the given definition."""
    with path.open("wb") as stream:
        writer = Writer(stream, compression=CompressionType.NONE)
        writer.start("ros2", "test")
        for number, (name, text) in enumerate(schemas.items()):
            schema = writer.register_schema(name, "ros2msg", text.encode())
            channel = writer.register_channel(f"/topic{number}", encoding, schema)
            writer.add_message(channel, 1 + number, data, 1 + number)
        writer.finish()
    return path


def ros1_record(fields: Mapping[str, bytes], data: bytes) -> bytes:
    parts = [name.encode() + b"=" + value for name, value in fields.items()]
    header = b"".join(struct.pack("<I", len(part)) + part for part in parts)
    return struct.pack("<I", len(header)) + header + struct.pack("<I", len(data)) + data


def ros1_connection(number: int, topic: str, name: str, definition: str) -> bytes:
    fields = {"topic": topic, "type": name, "md5sum": "*", "message_definition": definition}
    parts = [f"{key}={value}".encode() for key, value in fields.items()]
    data = b"".join(struct.pack("<I", len(part)) + part for part in parts)
    return ros1_record({"op": b"\7", "conn": struct.pack("<I", number), "topic": topic.encode()}, data)


def ros1_message(number: int, nanoseconds: int, data: bytes) -> bytes:
    time = struct.pack("<II", *divmod(nanoseconds, 10**9))
    return ros1_record({"op": b"\2", "conn": struct.pack("<I", number), "time": time}, data)


def ros1_bag(
    path: Path,
    connections: bytes,
    *chunks: tuple[str, bytes, int, Mapping[int, int]],
    count: int = 1,
    repeated: int = 1,
) -> Path:
    """Write a bag. Its chunks are given by compression, packed data, stated size and messages by connection.
    The index names each chunk `repeated` times."""
    magic = b"#ROSBAG V2.0\n"

    def header(at: int) -> bytes:
        fields = {
            "op": b"\3",
            "index_pos": struct.pack("<Q", at),
            "conn_count": struct.pack("<I", count),
            "chunk_count": struct.pack("<I", len(chunks) * repeated),
        }
        return ros1_record(fields, b" " * 4000)

    body, infos = b"", b""
    for compression, data, size, counts in chunks:
        at = len(magic) + len(header(0)) + len(body)
        fields = {"op": b"\5", "compression": compression.encode(), "size": struct.pack("<I", size)}
        body += ros1_record(fields, data)
        info = {
            "op": b"\6",
            "ver": struct.pack("<I", 1),
            "chunk_pos": struct.pack("<Q", at),
            "start_time": bytes(8),
            "end_time": struct.pack("<II", 0, 1),
            "count": struct.pack("<I", len(counts)),
        }
        pairs = b"".join(struct.pack("<II", *pair) for pair in counts.items())
        infos += ros1_record(info, pairs) * repeated
    at = len(magic) + len(header(0)) + len(body)
    path.write_bytes(magic + header(at) + body + connections + infos)
    return path


METADATA = """rosbag2_bagfile_information:
  version: 5
  storage_identifier: {storage}
  relative_file_paths:
    - {file}
  duration: {{nanoseconds: 1}}
  starting_time: {{nanoseconds_since_epoch: 0}}
  message_count: 1
  topics_with_message_count: []
  compression_format: "{format}"
  compression_mode: "{mode}"
"""

TABLES = """
    CREATE TABLE topics(id INTEGER PRIMARY KEY, name TEXT NOT NULL, type TEXT NOT NULL,
        serialization_format TEXT NOT NULL, offered_qos_profiles TEXT NOT NULL);
    CREATE TABLE message_definitions(id INTEGER PRIMARY KEY, topic_type TEXT NOT NULL, encoding TEXT NOT NULL,
        encoded_message_definition TEXT NOT NULL, type_description_hash TEXT NOT NULL);
    CREATE TABLE messages(id INTEGER PRIMARY KEY, topic_id INTEGER NOT NULL, timestamp INTEGER NOT NULL,
        data BLOB NOT NULL);
"""


def ros2_folder(
    folder: Path,
    data: bytes = WORD,
    *,
    name: str = TEXT,
    definition: str = "string data",
    mode: str = "",
    script: str = "",
) -> Path:
    """Write a rosbag2 folder with one message. `script` runs on its database at the end."""
    folder.mkdir()
    file = folder / "run.db3"
    with closing(sqlite3.connect(file)) as database, database:
        database.executescript(TABLES)
        database.execute("INSERT INTO topics VALUES(1, '/chatter', ?, 'cdr', '')", (name,))
        database.execute("INSERT INTO message_definitions VALUES(1, ?, 'ros2msg', ?, '')", (name, definition))
        database.execute("INSERT INTO messages VALUES(1, 1, 1, ?)", (data,))
        database.executescript(script)
    stored = file.name
    if mode == "file":
        stored = "run.db3.zstd"
        (folder / stored).write_bytes(PACK["zstd"](file.read_bytes()))
        file.unlink()
    text = METADATA.format(storage="sqlite3", file=stored, format="zstd" if mode else "", mode=mode)
    (folder / "metadata.yaml").write_text(text)
    return folder
