"""A type store for foreign messages that checks their stated lengths.

The rosbags library checks the lengths of strings and of lists of numbers. For lists of other types it trusts
the stated length when it converts between ROS 1 and ROS 2, and it creates as many objects as a message
states.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from functools import partial
from typing import TYPE_CHECKING, Any

from rosbags.interfaces import Msgdef, Nodetype
from rosbags.serde import SerdeError
from rosbags.typesys.store import Typestore

from kbot.record.encodings.foreign_types import field_parts

if TYPE_CHECKING:
    from rosbags.interfaces.typing import FieldDesc, Typesdict

LONG_MESSAGE = 1 << 24
"""Bytes above which objects are counted. Shorter messages give less than 400 MB of objects."""
MOST_OBJECTS = 1_000_000
"""Objects of a long message. Most long messages, such as images and point clouds, have only a few."""
_SHORTEST_TEXT = 4
"""Bytes of an empty string in a list."""

_CONVERSIONS = ("getsize_ros1_to_cdr", "ros1_to_cdr", "getsize_cdr_to_ros1", "cdr_to_ros1")
_READERS = ("deserialize_cdr_le", "deserialize_cdr_be", "deserialize_ros1")
_COUNTED = (*_READERS, "getsize_ros1_to_cdr", "getsize_cdr_to_ros1")


def safe_copy(store: Typestore) -> SafeStore:
    """A copy of a store. Types that are added to the copy are not added to the original."""
    copy = SafeStore()
    copy.fielddefs.update(store.fielddefs)
    copy.types.update(store.types)
    copy.find_lists(store.fielddefs)
    return copy


class SafeStore(Typestore):
    """Converts and reads messages in time and memory that are bounded by the length of the message."""

    def __init__(self) -> None:
        super().__init__()
        self.converted_parts = 0
        """Number of objects and strings in lists of all messages converted so far."""
        self._texts: dict[str, bool] = {}
        self._in_lists: set[str] = set()

    def register(self, typs: Typesdict) -> None:
        super().register(typs)
        self.find_lists(typs)

    def find_lists(self, types: Typesdict) -> None:
        """Record the types that occur in lists: only these can begin after the end of a message."""
        for _, fields in types.values():
            for _, described in fields:
                outer, kind, of_type, _ = field_parts(described)
                if outer == Nodetype.SEQUENCE and kind == Nodetype.NAME and of_type not in self._in_lists:
                    self._in_lists.add(of_type)
                    self.cache.pop(of_type, None)

    def get_msgdef(self, typename: str) -> Msgdef[object]:
        if typename not in self.cache:
            found = super().get_msgdef(typename)
            if typename in self._in_lists:
                bounded: dict[str, Any] = {
                    name: partial(self._within_input, getattr(found, name)) for name in _CONVERSIONS
                }
                found = replace(found, **bounded)
            self.cache[typename] = found
        return self.cache[typename]

    def hash_rihs01(self, typ: str) -> str:
        """The hash of a type in ROS 2, where `char` is `uint8`. The library hashes it as another type."""
        store = Typestore()
        for name in self._with_parts(typ):
            constants, fields = self.fielddefs[name]
            store.fielddefs[name] = constants, [(field, _as_in_ros2(kind)) for field, kind in fields]
        return Typestore.hash_rihs01(store, typ)

    def deserialize_cdr(self, rawdata: bytes | memoryview, typename: str) -> object:
        return Typestore.deserialize_cdr(self._counting(rawdata, typename), rawdata, typename)

    def deserialize_ros1(self, rawdata: bytes | memoryview, typename: str) -> object:
        return Typestore.deserialize_ros1(self._counting(rawdata, typename), rawdata, typename)

    def ros1_to_cdr(self, raw: bytes | memoryview, typename: str) -> memoryview:
        return Typestore.ros1_to_cdr(self._converting(raw, typename), raw, typename)

    def cdr_to_ros1(self, raw: bytes | memoryview, typename: str) -> memoryview:
        return Typestore.cdr_to_ros1(self._converting(raw, typename), raw, typename)

    def _converting(self, rawdata: bytes | memoryview, typename: str) -> Typestore:
        if self._has_string_lists(typename):
            self.converted_parts += len(rawdata) // _SHORTEST_TEXT
        return self._counting(rawdata, typename)

    def _counting(self, rawdata: bytes | memoryview, typename: str) -> Typestore:
        if len(rawdata) <= LONG_MESSAGE:
            return self
        if self._has_string_lists(typename):
            raise SerdeError(f"a message with lists of strings has more than {LONG_MESSAGE:,} bytes")
        return _CountingStore(self)

    def _within_input(self, convert: Callable[..., Any], data: memoryview, at: int, *others: Any) -> Any:  # noqa: ANN401 - as rosbags defines it
        """Convert one object. Raises SerdeError: it begins after the end of the message."""
        if at > len(data):
            raise SerdeError("the message ends before the end of a list")
        self.converted_parts += 1
        return convert(data, at, *others)

    def _has_string_lists(self, typename: str) -> bool:
        if typename not in self._texts:
            parts = (
                field_parts(kind) for name in self._with_parts(typename) for _, kind in self._fields(name)
            )
            self._texts[typename] = any(
                part.outer == Nodetype.SEQUENCE and part.of_type == "string" for part in parts
            )
        return self._texts[typename]

    def _with_parts(self, typename: str) -> list[str]:
        """A type and the types of its fields, at all levels."""
        found = {typename: None}
        pending = [typename]
        while pending:
            for _, described in self._fields(pending.pop()):
                part = field_parts(described)
                if part.kind == Nodetype.NAME and part.of_type not in found:
                    found[part.of_type] = None
                    pending.append(part.of_type)
        return list(found)

    def _fields(self, typename: str) -> list[tuple[str, FieldDesc]]:
        return self.fielddefs[typename][1]


def _as_in_ros2(described: Any) -> Any:  # noqa: ANN401 - nested tuples of rosbags
    if not isinstance(described, tuple):
        return described
    return ("uint8", 0) if described == ("char", 0) else tuple(map(_as_in_ros2, described))


class _CountingStore(Typestore):
    """A store for one message that counts the objects created from it."""

    def __init__(self, store: Typestore) -> None:
        super().__init__()
        self._store, self._left = store, MOST_OBJECTS

    def get_msgdef(self, typename: str) -> Msgdef[object]:
        found = self._store.get_msgdef(typename)
        counted: dict[str, Any] = {name: partial(self._count, getattr(found, name)) for name in _COUNTED}
        return replace(found, **counted)

    def _count(self, read: Callable[..., Any], *values: Any) -> Any:  # noqa: ANN401 - as rosbags defines it
        self._left -= 1
        if self._left < 0:
            raise SerdeError(
                f"a message of more than {LONG_MESSAGE:,} bytes may have at most {MOST_OBJECTS:,} values"
            )
        return read(*values)
