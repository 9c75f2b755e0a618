"""Encodes messages to bytes and decodes them, in ROS 2 (CDR) and ROS 1 format."""

from __future__ import annotations

import dataclasses
import struct
from collections.abc import Callable, Sequence
from functools import cache, partial
from types import SimpleNamespace
from typing import TYPE_CHECKING, Any, get_args, get_origin, get_type_hints

import numpy as np

from kbot.record.encodings.type_names import ros_name
from kbot.record.encodings.types import known_type, ros1_types, ros2_types
from kbot.text import KbotError

if TYPE_CHECKING:
    from numpy.typing import NDArray
    from rosbags.interfaces.typing import FieldDesc
    from rosbags.typesys.store import Typestore

Convert = Callable[[Any], Any]
Message = Any
"""A message of the requested type."""

MOST_IN_TUPLE = 4_000_000
"""Entries of a list that becomes a tuple. Each takes 32 bytes. Lists of sensors and maps remain arrays."""
ONLY_ON_THE_WIRE = ("seq", "structure_needs_at_least_one_member")
"""Fields that KBot's classes lack: ROS 1 has `seq` in headers, ROS 2 the other in messages without fields."""


def encode_cdr(message: object, name: str = "") -> bytes:
    """Encode as little-endian CDR with its header of four bytes. `name` is the type name if it is not a
    message type.

    Raises:
        KbotError: ROS has no such message, or a field has the wrong type.
    """
    kind: type = type(message)
    return _encoder(kind, name, ros1=False)(message)


def encode_ros1(message: object, name: str = "") -> bytes:
    """Encode as TCPROS and ROS 1 bags do. `name` and KbotError are as for `encode_cdr`."""
    kind: type = type(message)
    return _encoder(kind, name, ros1=True)(message)


@cache
def _encoder(kind: type, name: str, *, ros1: bool) -> Callable[[object], bytes]:
    """The function that encodes messages of a type. Cached, so that the type is looked up only once."""
    from rosbags.serde import SerdeError  # imported lazily: rosbags is slow to import

    name = name or ros_name(kind)
    convert = _outward(kind, ros1, name)
    write: Callable[[object, str], memoryview] = (
        ros1_types().serialize_ros1 if ros1 else partial(ros2_types().serialize_cdr, little_endian=True)
    )

    def encode(message: object) -> bytes:
        try:
            return bytes(write(convert(message) if convert else message, name))
        except (SerdeError, struct.error, TypeError, ValueError, AttributeError, OverflowError) as error:
            raise KbotError(f"not a {name}: {error}") from None

    return encode


def decode_cdr(data: bytes, message_type: type, name: str = "") -> Message:
    """Decode CDR. Raises KbotError: the bytes are not a message of this type."""
    return _decoded(ros2_types().deserialize_cdr, data, message_type, name)


def decode_ros1(data: bytes, message_type: type, name: str = "") -> Message:
    """Decode ROS 1 format. Raises KbotError: the bytes are not a message of this type."""
    return _decoded(ros1_types().deserialize_ros1, data, message_type, name)


def _decoded(decode: Callable[[bytes, str], object], data: bytes, message_type: type, name: str) -> object:
    from rosbags.serde import SerdeError

    name = name or ros_name(message_type)
    try:
        return _inward(message_type)(decode(data, name))
    except (SerdeError, LookupError, ValueError, MemoryError) as error:
        raise KbotError(f"{len(data)} bytes are not a {name}: {error}") from None


def _same(value: object) -> object:
    return value


@cache
def _outward(message_type: type, ros1: bool, name: str) -> Convert | None:
    """The function that converts a message for the rosbags library. None if the library can write it
    unchanged.

    The library needs numpy arrays for lists of numbers, and a sequence number in ROS 1 headers. It reads all
    other fields by name from KBot's objects.
    """
    store = ros1_types() if ros1 else ros2_types()
    if name not in store.fielddefs:
        raise KbotError(f"ROS {1 if ros1 else 2} has no {name}")
    known = dict(store.fielddefs[name][1])
    given = {field: 0 for field in ONLY_ON_THE_WIRE if field in known and not hasattr(message_type, field)}
    parts = {field: _convert_field(store, kind, ros1) for field, kind in known.items() if field not in given}
    if not given and not any(parts.values()):
        return None
    own = {field.name for field in dataclasses.fields(message_type)}
    # some field names are in upper case in ROS 1 but not in ROS 2
    places = [(field, field if field in own else field.lower(), part) for field, part in parts.items()]

    def convert(message: object) -> object:
        values = {
            field: part(getattr(message, name)) if part else getattr(message, name)
            for field, name, part in places
        }
        return SimpleNamespace(**given, **values)

    return convert


def _convert_field(store: Typestore, kind: FieldDesc, ros1: bool) -> Convert | None:
    from rosbags.interfaces import Nodetype

    match kind:
        case (Nodetype.NAME, name):
            return _outward_by_name(name, ros1)
        case (Nodetype.ARRAY | Nodetype.SEQUENCE, ((Nodetype.BASE, (base, _)), _)):
            return None if base == "string" else _to_array(base)
        case (Nodetype.ARRAY | Nodetype.SEQUENCE, ((Nodetype.NAME, name), _)):
            part = _outward_by_name(name, ros1)
            return (lambda values: [part(value) for value in values]) if part else None
    return None


def _outward_by_name(name: str, ros1: bool) -> Convert | None:
    message_type = known_type(name)
    return _outward(message_type, ros1, name) if message_type else None


def _to_array(base: str) -> Convert:
    dtype = np.dtype({"byte": "uint8", "char": "uint8"}.get(base, base))
    last: tuple[object, NDArray[Any]] = None, np.empty(0)

    def convert(values: Sequence[float] | bytes) -> NDArray[Any]:
        nonlocal last
        if isinstance(values, bytes):
            return np.frombuffer(values, dtype)
        if type(values) is not tuple:
            return np.asarray(values, dtype)
        known, array = last
        if values is not known:  # a covariance is often the same object in every message
            array = np.asarray(values, dtype)
            last = values, array
        return array

    return convert


@cache
def _inward(message_type: type) -> Convert:
    """The function that creates KBot's message from the library's."""
    hints = get_type_hints(message_type)
    parts = tuple((field.name, _value(hints[field.name])) for field in dataclasses.fields(message_type))

    def convert(found: object) -> object:
        values = ((name, part, _get(found, name)) for name, part in parts)
        return message_type(**{name: part(value) for name, part, value in values if value is not None})

    return convert


def _get(found: object, name: str) -> object:
    """A field of the library's message. In ROS 1 some names are in upper case, and some fields are
    missing."""
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

    def convert(values: Any) -> tuple[Any, ...]:  # noqa: ANN401 - a list or an array of the library's
        if len(values) > MOST_IN_TUPLE:
            raise ValueError(f"a list has {len(values):,} entries (limit: {MOST_IN_TUPLE:,})")
        return tuple(part(v) for v in (values.tolist() if hasattr(values, "tolist") else values))

    return convert
