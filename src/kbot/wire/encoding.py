"""Messages to bytes and back, as ROS 2 (CDR) and ROS 1 put them on the wire."""

from __future__ import annotations

import dataclasses
import struct
from collections.abc import Callable
from functools import cache
from typing import Any, get_args, get_origin, get_type_hints

from kbot.text import KbotError
from kbot.wire.names import ros_name
from kbot.wire.types import ros1_types, ros2_types
from kbot.wire.writer import make_writer

Convert = Callable[[Any], Any]
Message = Any
"""Of the type that is asked for."""


def encode_cdr(message: object, name: str = "") -> bytes:
    """Little-endian CDR with its four bytes of header; `name` is that of the type, where it is not a
    message's. Raises KbotError: ROS has no such message, or a field is not of its type."""
    kind: type = type(message)
    return _encoder(kind, name, ros1=False)(message)


def encode_ros1(message: object, name: str = "") -> bytes:
    """As TCPROS and bags of ROS 1 carry it; `name` and KbotError as for `encode_cdr`."""
    kind: type = type(message)
    return _encoder(kind, name, ros1=True)(message)


@cache
def _encoder(kind: type, name: str, *, ros1: bool) -> Callable[[object], bytes]:
    """What writes messages of a kind; all that is the same for each of them is looked up here."""
    name = name or ros_name(kind)
    store = ros1_types() if ros1 else ros2_types()
    if name not in store.fielddefs:
        raise KbotError(f"ROS {1 if ros1 else 2} has no {name}")
    write = make_writer(store, name, kind, ros1=ros1)

    def encode(message: object) -> bytes:
        try:
            return write(message)
        except (struct.error, TypeError, ValueError, AttributeError, OverflowError) as error:
            raise KbotError(f"no {name}: {error}") from None

    return encode


def decode_cdr(data: bytes, message_type: type, name: str = "") -> Message:
    """Raises KbotError: the bytes are no such message."""
    return _decoded(ros2_types().deserialize_cdr, data, message_type, name)


def decode_ros1(data: bytes, message_type: type, name: str = "") -> Message:
    """Raises KbotError: the bytes are no such message."""
    return _decoded(ros1_types().deserialize_ros1, data, message_type, name)


def _decoded(decode: Callable[[bytes, str], object], data: bytes, message_type: type, name: str) -> object:
    from rosbags.serde import SerdeError

    name = name or ros_name(message_type)
    try:
        return _inward(message_type)(decode(data, name))
    except (SerdeError, LookupError, ValueError, MemoryError) as error:
        raise KbotError(f"{len(data)} bytes are no {name}: {error}") from None


def _same(value: object) -> object:
    return value


@cache
def _inward(message_type: type) -> Convert:
    """What makes our message of the library's."""
    hints = get_type_hints(message_type)
    parts = tuple((field.name, _value(hints[field.name])) for field in dataclasses.fields(message_type))

    def convert(found: object) -> object:
        values = ((name, part, _get(found, name)) for name, part in parts)
        return message_type(**{name: part(value) for name, part, value in values if value is not None})

    return convert


def _get(found: object, name: str) -> object:
    """A field of the library's message; ROS 1 has some names in capitals, and some fields not at all."""
    return getattr(found, name) if hasattr(found, name) else getattr(found, name.upper(), None)


def _value(hint: object) -> Convert:
    if dataclasses.is_dataclass(hint) and isinstance(hint, type):
        return _inward(hint)
    if hint is bytes:
        return bytes
    if getattr(get_origin(hint), "__name__", "") == "ndarray":
        return _same
    of = next((arg for arg in get_args(hint) if arg is not Ellipsis), None)
    if of is None:
        return _same
    part = _value(of)
    return lambda values: tuple(part(v) for v in (values.tolist() if hasattr(values, "tolist") else values))
