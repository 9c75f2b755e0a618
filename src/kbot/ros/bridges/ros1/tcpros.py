"""The TCPROS protocol: connection headers, and blocks with their length."""

from __future__ import annotations

import asyncio
import socket
import struct

LARGEST_HEADER = 1 << 18
"""Bytes. A header has the definition of the message type."""
LARGEST_MESSAGE = 1 << 24
"""Bytes of the largest message that is received."""
HANDSHAKE_SECONDS = 5.0


class ProtocolError(Exception):
    """The other side does not follow TCPROS, or refuses the connection."""


def encode_header(fields: dict[str, str]) -> bytes:
    """Encode a connection header, including its length."""
    lines = [f"{key}={value}".encode() for key, value in fields.items()]
    body = b"".join(struct.pack("<I", len(line)) + line for line in lines)
    return struct.pack("<I", len(body)) + body


def decode_header(body: bytes) -> dict[str, str]:
    """Decode a connection header. `body` does not include its length.

    Raises:
        ProtocolError: it is not a header.
    """
    fields, at = {}, 0
    while at < len(body):
        if at + 4 > len(body):
            raise ProtocolError("the header ends within a field's length")
        (length,) = struct.unpack_from("<I", body, at)
        line = body[at + 4 : at + 4 + length]
        key, equals, value = line.partition(b"=")
        if len(line) != length or not equals:
            raise ProtocolError("the header has a field that is not NAME=VALUE")
        fields[key.decode(errors="replace")] = value.decode(errors="replace")
        at += 4 + length
    return fields


def read_header(connection: socket.socket) -> dict[str, str]:
    """Read a connection header. Raises ProtocolError, OSError (also after a timeout)."""
    return decode_header(read_block(connection, LARGEST_HEADER))


def read_block(connection: socket.socket, largest: int = LARGEST_MESSAGE) -> bytes:
    """Read a block and its length.

    Raises:
        ProtocolError: the block is longer than `largest`.
        OSError: the other side has disconnected.
    """
    return read_exactly(connection, _length(read_exactly(connection, 4), largest))


def read_exactly(connection: socket.socket, length: int) -> bytes:
    """Read `length` bytes. Raises OSError: the other side has disconnected before."""
    parts = bytearray()
    while len(parts) < length:
        part = connection.recv(min(65536, length - len(parts)))
        if not part:
            raise ConnectionResetError("the other side has disconnected")
        parts += part
    return bytes(parts)


async def receive_header(reader: asyncio.StreamReader) -> dict[str, str]:
    """Like `read_header`, with asyncio. Raises ProtocolError, OSError, EOFError."""
    return decode_header(await receive_block(reader, LARGEST_HEADER))


async def receive_block(reader: asyncio.StreamReader, largest: int = LARGEST_MESSAGE) -> bytes:
    """Like `read_block`, with asyncio. Raises ProtocolError, OSError, EOFError."""
    return await reader.readexactly(_length(await reader.readexactly(4), largest))


def _length(data: bytes, largest: int) -> int:
    (length,) = struct.unpack("<I", data)
    if length > largest:
        raise ProtocolError(f"a block of {length} bytes is too large: the limit is {largest}")
    return int(length)


def check_header(fields: dict[str, str], topic: str, type_name: str, md5: str) -> None:
    """Check that the header of the other side has the same topic, type and definition. `*` matches any.

    Raises:
        ProtocolError: it has another, or it reports an error.
    """
    if "error" in fields:
        raise ProtocolError(fields["error"])
    for name, ours in (("topic", topic), ("type", type_name), ("md5sum", md5)):
        theirs = fields.get(name, ours if name == "topic" else "")
        if theirs not in (ours, "*"):
            raise ProtocolError(f"{topic} has {name} {ours}, not '{theirs}'")
