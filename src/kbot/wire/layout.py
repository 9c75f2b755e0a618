"""How messages of one type lie in bytes: found out of its definition once, and followed for each message.

A layout is a few steps, for runs of numbers are packed by one `struct`. CDR aligns numbers to their size from
the message's first byte, so there is a `struct` for each of the eight places a run may begin at.
"""

from __future__ import annotations

import dataclasses
import struct
from collections.abc import Callable, Iterator, Sequence
from functools import lru_cache
from operator import attrgetter
from typing import TYPE_CHECKING, Any, NamedTuple

from kbot.text import KbotError
from kbot.wire.types import known_type, ros1_types, ros2_types

if TYPE_CHECKING:
    from rosbags.interfaces.typing import FieldDesc
    from rosbags.typesys.store import Typestore

Step = Callable[[Any, list[bytes], int], int]
"""Appends the bytes of a part of a message that begins at a place, and returns the place behind it."""

CODES = {
    "bool": "?", "byte": "B", "char": "B", "int8": "b", "uint8": "B", "int16": "h", "uint16": "H",
    "int32": "i", "uint32": "I", "int64": "q", "uint64": "Q", "float32": "f", "float64": "d",
}  # fmt: skip
NUL_IN_CDR = b"\0"
ONLY_ON_THE_WIRE = {"seq": "I", "structure_needs_at_least_one_member": "B"}
"""What ROS 1 has in headers, and ROS 2 in what is empty: nought."""
SHORT = 200
"""Characters of a text, such as a frame's name, that is likely to come again."""


class _Number(NamedTuple):
    """A number of a message, or an array of a fixed `length`; one only on the wire has no `path`."""

    path: str
    code: str
    length: int | None = None


def layout(message_type: type, name: str, *, ros1: bool) -> tuple[Step, ...]:
    """The steps that write a message of a ROS type. Raises KbotError where ROS has no such type."""
    store = ros1_types() if ros1 else ros2_types()
    if name not in store.fielddefs:
        raise KbotError(f"ROS {1 if ros1 else 2} has no {name}")
    steps: list[Step] = []
    run: list[_Number] = []
    for part in _Type(store, ros1).parts(name, message_type, ""):
        if isinstance(part, _Number):
            if part.length is not None or (run and run[-1].length is not None):
                steps += _numbers(run, ros1)
                run = []
            run.append(part)
        else:
            steps += [*_numbers(run, ros1), part]
            run = []
    return (*steps, *_numbers(run, ros1))


class _Type:
    def __init__(self, store: Typestore, ros1: bool) -> None:
        self._store, self._ros1 = store, ros1

    def parts(self, name: str, message_type: type | None, path: str) -> Iterator[_Number | Step]:
        """Of a message that is found at a path in another."""
        own = {f.name for f in dataclasses.fields(message_type)} if message_type else set()
        for field, desc in self._store.fielddefs[name][1]:
            if field in ONLY_ON_THE_WIRE and field not in own:
                if field == "seq" or not self._ros1:
                    yield _Number("", ONLY_ON_THE_WIRE[field])
            else:
                # ROS 1 has some names in capitals that ROS 2 has not
                yield from self._field(desc, path + (field if field in own else field.lower()))

    def _field(self, desc: FieldDesc, path: str) -> Iterator[_Number | Step]:
        from rosbags.interfaces import Nodetype

        match desc:
            case (Nodetype.BASE, ("string", _)):
                yield _text(attrgetter(path), self._ros1)
            case (Nodetype.BASE, (base, _)):
                yield _Number(path, CODES[base])
            case (Nodetype.NAME, name):
                yield from self.parts(name, known_type(name), f"{path}.")
            case (Nodetype.ARRAY, ((Nodetype.BASE, (base, _)), count)) if base != "string":
                yield _Number(path, CODES[base], count)
            case (Nodetype.SEQUENCE, ((Nodetype.BASE, (base, _)), _)) if base != "string":
                yield _sequence(attrgetter(path), CODES[base], self._ros1)
            case (Nodetype.ARRAY | Nodetype.SEQUENCE as kind, (item, count)):
                fixed = count if kind is Nodetype.ARRAY else None
                yield _items(attrgetter(path), self._item(item), fixed, self._ros1)
            case _:
                raise TypeError(f"a field of an unknown kind: {desc!r}")

    def _item(self, desc: FieldDesc) -> tuple[Step, ...]:
        from rosbags.interfaces import Nodetype

        match desc:
            case (Nodetype.NAME, name):
                return layout(known_type(name) or type(None), name, ros1=self._ros1)
        return (_text(lambda text: text, self._ros1),)


def _numbers(run: Sequence[_Number], ros1: bool) -> list[Step]:
    """One step for numbers that follow each other; it is also given an array of them."""
    if not run:
        return []
    paths = [number.path for number in run if number.path]
    packers = tuple(_packer(run, 0 if ros1 else start, ros1) for start in range(8))
    is_one = len(paths) == 1 and run[-1].length is None
    get: Callable[[Any], Any] = attrgetter(*paths) if paths else lambda message: ()

    def write(message: object, out: list[bytes], at: int) -> int:
        packer, values = packers[at & 7], get(message)
        out.append(packer.pack(values) if is_one else packer.pack(*values))
        return at + packer.size

    return [write]


def _packer(run: Sequence[_Number], start: int, ros1: bool) -> struct.Struct:
    form, at = "<", start
    for number in run:
        size = struct.calcsize(number.code)
        gap = 0 if ros1 else -at % size
        length = 1 if number.length is None else number.length
        what = f"{length}{number.code}" if number.path else f"{size}x"
        form += f"{gap}x{what}"
        at += gap + size * length
    return struct.Struct(form)


_COUNT = struct.Struct("<I")
_PADS = (b"", b"\0", b"\0\0", b"\0\0\0", b"\0\0\0\0")


def _count(count: int, out: list[bytes], at: int, ros1: bool) -> int:
    data = _COUNT.pack(count) if ros1 else _PADS[-at % 4] + _COUNT.pack(count)
    out.append(data)
    return at + len(data)


def _text(get: Callable[[Any], str], ros1: bool) -> Step:
    def write(message: object, out: list[bytes], at: int) -> int:
        text = get(message)
        data = _short(text, ros1) if len(text) < SHORT else _encoded(text, ros1)
        if at & 3 and not ros1:
            data = _PADS[-at % 4] + data
        out.append(data)
        return at + len(data)

    return write


def _encoded(text: str, ros1: bool) -> bytes:
    data = text.encode() if ros1 else text.encode() + NUL_IN_CDR
    return _COUNT.pack(len(data)) + data


_short = lru_cache(1000)(_encoded)


def _sequence(get: Callable[[Any], Any], code: str, ros1: bool) -> Step:
    """Any count of numbers, as a tuple, a numpy array, or bytes that hold them."""
    size = struct.calcsize(code)

    def write(message: object, out: list[bytes], at: int) -> int:
        values = get(message)
        if hasattr(values, "tobytes"):
            values = values.astype(f"<{code}", copy=False).tobytes()
        data = values if isinstance(values, bytes) else struct.pack(f"<{len(values)}{code}", *values)
        at = _count(len(data) // size, out, at, ros1)
        gap = 0 if ros1 or not data else -at % size
        out += (_PADS[gap], data)
        return at + gap + len(data)

    return write


def _items(
    get: Callable[[Any], Sequence[Any]], steps: tuple[Step, ...], fixed: int | None, ros1: bool
) -> Step:
    """Messages or texts, one after the other; `fixed` is how many where that is not said."""

    def write(message: object, out: list[bytes], at: int) -> int:
        items = get(message)
        if fixed is None:
            at = _count(len(items), out, at, ros1)
        elif len(items) != fixed:
            raise ValueError(f"{len(items)} where there are always {fixed}")
        for item in items:
            for step in steps:
                at = step(item, out, at)
        return at

    return write
