"""One message of a recording, with its bytes in either encoding; also of types KBot itself lacks."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from functools import cache, cached_property
from typing import TYPE_CHECKING, Any

from kbot.text import KbotError
from kbot.wire import decode_cdr, decode_ros1, encode_cdr, encode_ros1
from kbot.wire.encoding import ONLY_ON_THE_WIRE
from kbot.wire.types import known_type, ros1_types, ros2_types

if TYPE_CHECKING:
    from rosbags.typesys.store import Typestore


class Types:
    """The types of a recording: those of ROS, and those it brings along."""

    def __init__(self) -> None:
        self.ros1: Typestore = ros1_types()
        self.ros2: Typestore = ros2_types()
        self._has_own = False

    def learn(self, name: str, definition: str) -> None:
        """Take in a definition as ROS writes it; what is known already stays as it is.

        Raises:
            KbotError: it cannot be understood.
        """
        from rosbags.typesys import TypesysError, get_types_from_msg

        if name in self.ros2.fielddefs:
            return
        if not self._has_own:
            self.ros1, self.ros2, self._has_own = _copy(self.ros1), _copy(self.ros2), True
        try:
            found = get_types_from_msg(definition, name)
            for store in (self.ros1, self.ros2):
                store.register({key: value for key, value in found.items() if key not in store.fielddefs})
        except TypesysError as error:
            raise KbotError(f"the definition of {name} cannot be read: {error}") from None


@cache
def _unlike(name: str) -> type | None:
    """Our message of a type that has other fields in ROS 1 than in ROS 2, as markers have; None for any
    other, whose bytes are the same but for how they are aligned."""
    kind = known_type(name)
    if kind is None or name not in ros1_types().fielddefs:
        return None
    is_same = list(_layout(ros1_types(), name)) == list(_layout(ros2_types(), name))
    return None if is_same else kind


def _layout(store: Typestore, name: str) -> Iterator[object]:
    """The kinds of a type's fields, in their order, those of its parts in their place."""
    from rosbags.interfaces import Nodetype

    for field, desc in store.fielddefs[name][1]:
        if field in ONLY_ON_THE_WIRE:
            continue
        outer, inner = desc
        part: object = desc
        if outer in (Nodetype.SEQUENCE, Nodetype.ARRAY):
            yield outer
            part = inner[0]
        match part:
            case (Nodetype.NAME, str(below)):
                yield from _layout(store, below)
            case _:
                yield part


def _copy(store: Typestore) -> Typestore:
    from rosbags.typesys import Stores, get_typestore

    copy = get_typestore(Stores.EMPTY)
    copy.fielddefs.update(store.fielddefs)
    copy.types.update(store.types)
    return copy


class Entry:
    """A message as it was recorded; `Recordable`, so that it can be written again."""

    def __init__(
        self,
        topic: str,
        type_name: str,
        nanoseconds: int,
        data: bytes,
        types: Types,
        *,
        is_ros1: bool = False,
    ) -> None:
        self.topic = topic
        self.type_name = type_name
        self.nanoseconds = nanoseconds
        self.data = data
        self._types = types
        self._is_ros1 = is_ros1

    @cached_property
    def cdr(self) -> bytes:
        """Raises KbotError: the bytes are no such message."""
        if not self._is_ros1:
            return self.data
        kind = _unlike(self.type_name)
        if kind is not None:
            return encode_cdr(decode_ros1(self.data, kind))
        return bytes(self._converted(self._types.ros2.ros1_to_cdr, self.data))

    @cached_property
    def ros1(self) -> bytes:
        """Raises KbotError: the bytes are no such message."""
        if self._is_ros1:
            return self.data
        kind = _unlike(self.type_name)
        if kind is not None:
            return encode_ros1(decode_cdr(self.data, kind))
        return bytes(self._converted(self._types.ros2.cdr_to_ros1, self.data))

    @property
    def ros1_definition(self) -> tuple[str, str]:
        """Text and MD5."""
        text, md5 = self._types.ros1.generate_msgdef(self.type_name)
        return text, md5

    @property
    def ros2_definition(self) -> tuple[str, str]:
        """Text and RIHS01 hash."""
        store = self._types.ros2
        return store.generate_msgdef(self.type_name, ros_version=2)[0], store.hash_rihs01(self.type_name)

    def message(self) -> Any:  # noqa: ANN401 - whatever its type says
        """The message with the fields of its type. Raises KbotError: the bytes are no such message."""
        return self._converted(self._types.ros2.deserialize_cdr, self.cdr)

    def _converted(self, convert: Callable[[bytes, str], Any], data: bytes) -> Any:  # noqa: ANN401 - of the type that is recorded
        from rosbags.serde import SerdeError

        try:
            return convert(data, self.type_name)
        except (SerdeError, KeyError, IndexError, ValueError) as error:
            raise KbotError(
                f"{self.topic} at {self.nanoseconds * 1e-9:.3f} s is no {self.type_name}: {error}"
            ) from None
