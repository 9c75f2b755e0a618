"""The TCPROS protocol: the header of a connection, and messages with their length."""

from __future__ import annotations

import asyncio
import socket
import struct

LARGEST_HEADER = 1 << 18
LARGEST_MESSAGE = 1 << 24
HANDSHAKE_SECONDS = 5.0


class ProtocolError(Exception):
    """The other side does not speak TCPROS, or refuses."""


def encode_header(fields: dict[str, str]) -> bytes:
    """`fields` as they go over the wire, with the length of all before them."""
    lines = [f"{key}={value}".encode() for key, value in fields.items()]
    body = b"".join(struct.pack("<I", len(line)) + line for line in lines)
    return struct.pack("<I", len(body)) + body


def decode_header(body: bytes) -> dict[str, str]:
    """The fields of a header, without the length before it.

    Raises:
        ProtocolError: it is none.
    """
    fields, at = {}, 0
    while at < len(body):
        if at + 4 > len(body):
            raise ProtocolError("a header that ends within a length")
        (length,) = struct.unpack_from("<I", body, at)
        line = body[at + 4 : at + 4 + length]
        key, equals, value = line.partition(b"=")
        if len(line) != length or not equals:
            raise ProtocolError("a header with a field that is no name=value")
        fields[key.decode(errors="replace")] = value.decode(errors="replace")
        at += 4 + length
    return fields


def read_header(connection: socket.socket) -> dict[str, str]:
    """Raises ProtocolError, OSError (also when it does not come in time)."""
    return decode_header(read_block(connection, LARGEST_HEADER))


def read_block(connection: socket.socket, largest: int = LARGEST_MESSAGE) -> bytes:
    """What comes next with its length before it.

    Raises:
        ProtocolError: it is longer than `largest`.
        OSError: the other side is gone.
    """
    return read_exactly(connection, _length(read_exactly(connection, 4), largest))


def read_exactly(connection: socket.socket, length: int) -> bytes:
    """Raises OSError: the other side is gone before that many bytes came."""
    parts = bytearray()
    while len(parts) < length:
        part = connection.recv(min(65536, length - len(parts)))
        if not part:
            raise ConnectionResetError("the other side is gone")
        parts += part
    return bytes(parts)


async def receive_header(reader: asyncio.StreamReader) -> dict[str, str]:
    """As `read_header`, on a loop. Raises ProtocolError, OSError, EOFError."""
    return decode_header(await receive_block(reader, LARGEST_HEADER))


async def receive_block(reader: asyncio.StreamReader, largest: int = LARGEST_MESSAGE) -> bytes:
    """As `read_block`, on a loop. Raises ProtocolError, OSError, EOFError."""
    return await reader.readexactly(_length(await reader.readexactly(4), largest))


def _length(data: bytes, largest: int) -> int:
    (length,) = struct.unpack("<I", data)
    if length > largest:
        raise ProtocolError(f"{length} bytes at once, where {largest} are the most")
    return int(length)


def check_header(fields: dict[str, str], topic: str, type_name: str, md5: str) -> None:
    """Whether the other side means the same topic, type and definition; `*` stands for any.

    Raises:
        ProtocolError: it does not; the text says what each side has.
    """
    if "error" in fields:
        raise ProtocolError(fields["error"])
    for name, ours in (("topic", topic), ("type", type_name), ("md5sum", md5)):
        theirs = fields.get(name, ours if name == "topic" else "")
        if theirs not in (ours, "*"):
            raise ProtocolError(f"{topic} has {name} {ours}, not '{theirs}'")
