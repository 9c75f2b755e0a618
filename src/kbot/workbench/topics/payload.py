"""Messages of topics as the page takes them: JSON text, or a binary frame where they carry large arrays.

A binary frame is the length of a header as a little-endian 32-bit number, the header, which is JSON padded
with spaces to a multiple of eight, and the arrays one after the other, each beginning at a multiple of eight
bytes. The header is a TopicMessage whose `arrays` say for each field that is one: its kind (`int8`, `uint8`,
`float32` or `float64`), its offset in bytes from the header's end, and how many numbers it has.
"""

from __future__ import annotations

import dataclasses
import json
import struct
from typing import Any

import numpy as np

from kbot.record.encodings.plain import to_plain
from kbot.record.feed import Packet

_ALIGNED = 8


def encode_packet(packet: Packet, is_latched: bool = False) -> str | bytes:
    """One message of a topic, said before it was asked for where it `is_latched`: text, or bytes where fields
    of it are arrays or bytes."""
    message: Any = packet.message
    fields: dict[str, Any] = {}
    arrays: dict[str, list[object]] = {}
    parts: list[bytes] = []
    at = 0
    for field in dataclasses.fields(message):
        value = getattr(message, field.name)
        if isinstance(value, bytes):
            value = np.frombuffer(value, np.uint8)
        if not isinstance(value, np.ndarray):
            fields[field.name] = to_plain(value)
            continue
        data = value.astype(value.dtype.newbyteorder("<"), copy=False).tobytes()
        arrays[field.name] = [value.dtype.name, at, value.size]
        parts.append(_padded(data, b"\0"))
        at += len(parts[-1])
    header = {
        "type": "message",
        "topic": packet.topic,
        "kind": packet.type_name,
        "time": packet.nanoseconds * 1e-9,
        "is_latched": is_latched,
        "message": fields,
    }
    if not arrays:
        return _json(header)
    text = _padded(b"    " + _json({**header, "arrays": arrays}).encode(), b" ")[4:]
    return struct.pack("<I", len(text)) + text + b"".join(parts)


def _json(value: object) -> str:
    return json.dumps(value, separators=(",", ":"), allow_nan=False)


def _padded(data: bytes, filling: bytes) -> bytes:
    return data + filling * (-len(data) % _ALIGNED)
