"""What writes messages of one type, in either encoding, made once of the type's definition.

Numbers that follow each other, also those of messages within, are read together and packed together. In CDR
each stands at a multiple of its size, so that there is one packing for each place they may begin at.
"""

from __future__ import annotations

import dataclasses
import struct
from collections.abc import Callable, Iterator, Sequence
from itertools import groupby
from operator import attrgetter
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from kbot.wire.types import known_type

if TYPE_CHECKING:
    from rosbags.interfaces.typing import FieldDesc
    from rosbags.typesys.store import Typestore

CODES = {
    **{"bool": "?", "byte": "B", "char": "B", "int8": "b", "uint8": "B", "int16": "h", "uint16": "H"},
    **{"int32": "i", "uint32": "I", "int64": "q", "uint64": "Q", "float32": "f", "float64": "d"},
}
"""Numbers as `struct` and numpy call them."""

EMPTY = "structure_needs_at_least_one_member"
ONLY_ON_THE_WIRE = ("seq", EMPTY)
"""What ROS 1 has in headers, and ROS 2 in what is empty; it is 0."""

WIDEST = 8
_LENGTHS = [struct.Struct(f"<{gap}xI") for gap in range(4)]
"""By the bytes that are left out before."""

Parts = list[bytes]
Step = Callable[[Any, Parts, int], int]
"""Adds to the parts what stands in a value from a place on, and returns where that ends."""
Numbers = Sequence[float] | bytes | NDArray[Any]


def make_writer(store: Typestore, name: str, kind: type, *, ros1: bool) -> Callable[[object], bytes]:
    """Writes messages of a kind as that type of the store, in CDR unless `ros1`. What does not fit raises
    struct.error, TypeError, ValueError, AttributeError or OverflowError."""
    steps = _steps(store, name, kind, ros1)
    head = b"" if ros1 else b"\0\1\0\0"

    def write(message: object) -> bytes:
        parts, place = [head], 0
        for step in steps:
            place = step(message, parts, place)
        return b"".join(parts)

    return write


def _steps(store: Typestore, name: str, kind: type | None, ros1: bool) -> list[Step]:
    steps: list[Step] = []
    for code, leaves in groupby(_leaves(store, name, kind, ros1), lambda leaf: bool(_code(leaf[1]))):
        if code:
            steps.append(_numbers([(path, _code(desc)) for path, desc in leaves], ros1))
        else:
            steps += [_at(path, _value(store, desc, ros1)) for path, desc in leaves]
    return steps


def _leaves(
    store: Typestore, name: str, kind: type | None, ros1: bool, prefix: str = ""
) -> Iterator[tuple[str, FieldDesc]]:
    """Where in a message each field is that is no message, empty where it is 0, and its type."""
    from rosbags.interfaces import Nodetype

    own = {field.name for field in dataclasses.fields(kind)} if kind else None
    for field, desc in store.fielddefs[name][1]:
        # ROS 1 has some names in capitals that ROS 2 has not
        path = prefix + (field if own is None or field in own else field.lower())
        if own is not None and field in ONLY_ON_THE_WIRE and field not in own:
            if not (ros1 and field == EMPTY):
                yield "", desc
        elif desc[0] == Nodetype.NAME:
            inner = str(desc[1])
            yield from _leaves(store, inner, known_type(inner), ros1, f"{path}.")
        else:
            yield path, desc


def _code(desc: FieldDesc) -> str:
    """Of a number; empty for all else."""
    from rosbags.interfaces import Nodetype

    match desc:
        case (Nodetype.BASE, (base, _)):
            return CODES.get(base, "")
    return ""


def _numbers(fields: list[tuple[str, str]], ros1: bool) -> Step:
    def packing(place: int) -> struct.Struct:
        text = "<"
        for path, code in fields:
            size = struct.calcsize(code)
            gap = 0 if ros1 else -(place + struct.calcsize(text)) % size
            text += f"{gap}x{code}" if path else f"{gap + size}x"
        return struct.Struct(text)

    packings = [packing(place) for place in range(WIDEST)]
    paths = [path for path, _ in fields if path]
    if len(paths) > 1:
        read: Callable[[Any], tuple[Any, ...]] = attrgetter(*paths)
    elif paths:
        first = attrgetter(*paths)
        read = lambda message: (first(message),)  # noqa: E731 - one of three
    else:
        read = lambda message: ()  # noqa: E731 - the same

    def step(message: object, parts: Parts, place: int) -> int:
        packing = packings[place % WIDEST]
        parts.append(packing.pack(*read(message)))
        return place + packing.size

    return step


def _at(path: str, step: Step) -> Step:
    read = attrgetter(path)
    return lambda message, parts, place: step(read(message), parts, place)


def _value(store: Typestore, desc: FieldDesc, ros1: bool) -> Step:
    from rosbags.interfaces import Nodetype

    match desc:
        case (Nodetype.BASE, _):
            return _text(ros1)
        case (kind, (item, count)) if code := _code(item):
            return _array(code, count if kind == Nodetype.ARRAY else None, ros1)
        case (kind, ((Nodetype.NAME, name), count)):
            steps = _steps(store, name, known_type(name), ros1)
        case (kind, (item, count)):
            steps = [_value(store, item, ros1)]
    return _list(steps, count if kind == Nodetype.ARRAY else None, ros1)


def _text(ros1: bool) -> Step:
    end = b"" if ros1 else b"\0"

    def step(text: str, parts: Parts, place: int) -> int:
        data = text.encode() + end
        place = _length(len(data), parts, place, ros1)
        parts.append(data)
        return place + len(data)

    return step


def _list(steps: list[Step], count: int | None, ros1: bool) -> Step:
    def step(values: Sequence[Any], parts: Parts, place: int) -> int:
        place = _begin(len(values), count, parts, place, ros1)
        for value in values:
            for item in steps:
                place = item(value, parts, place)
        return place

    return step


def _array(code: str, count: int | None, ros1: bool) -> Step:
    size, dtype = struct.calcsize(code), np.dtype(f"<{code}")
    last: tuple[object, bytes] = None, b""

    def pack(values: Numbers) -> bytes:
        nonlocal last
        if isinstance(values, bytes):
            return values
        if type(values) is not tuple:
            return np.asarray(values, dtype).tobytes()
        known, data = last
        if values is not known:  # as a covariance is, the same in message after message
            data = struct.pack(f"<{len(values)}{code}", *values)
            last = values, data
        return data

    def step(values: Numbers, parts: Parts, place: int) -> int:
        data = pack(values)
        found, rest = divmod(len(data), size)
        if rest:
            raise ValueError(f"{len(data)} bytes where each number has {size}")
        place = _begin(found, count, parts, place, ros1)
        if data and not ros1 and place % size:
            parts.append(bytes(-place % size))
            place += -place % size
        parts.append(data)
        return place + len(data)

    return step


def _begin(found: int, count: int | None, parts: Parts, place: int, ros1: bool) -> int:
    """Of a list: its length, unless its type has a `count`. Raises ValueError: it has another."""
    if count is None:
        return _length(found, parts, place, ros1)
    if found != count:
        raise ValueError(f"{found} values where there are {count}")
    return place


def _length(length: int, parts: Parts, place: int, ros1: bool) -> int:
    packing = _LENGTHS[0 if ros1 else -place % 4]
    parts.append(packing.pack(length))
    return place + packing.size
