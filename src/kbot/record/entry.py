"""One message of a recording, with its bytes in both encodings, also for types that KBot does not know."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from functools import cache, cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any

from kbot.brief import Brief
from kbot.record.encodings.foreign_types import EVENT, ShapeCheck, code_cost, read_definition
from kbot.record.encodings.quality import is_latched, recorded_qos
from kbot.record.encodings.serialization import (
    ONLY_ON_THE_WIRE,
    decode_cdr,
    decode_ros1,
    encode_cdr,
    encode_ros1,
)
from kbot.record.encodings.types import known_type, ros1_types, ros2_types
from kbot.record.limits import Allowance, RecordingTooLarge, check_names
from kbot.text import KbotError
from kbot.text.errors import reading

if TYPE_CHECKING:
    from rosbags.interfaces.typing import Typesdict
    from rosbags.typesys.store import Typestore

    from kbot.record.encodings.safe_store import SafeStore


MOST_CODE = 15_000
"""Limit on the cost of generating code for all types of a recording, in units of 0.2 ms. 300 ROS types cost
7,000."""


class UnusableType(KbotError):
    """The definition of a type cannot be used, so messages of this type cannot be read or converted."""


class Types:
    """The message types of a recording: those of ROS, and those that the recording defines."""

    def __init__(self, path: str | Path, allowance: Allowance | None = None) -> None:
        """`path` is the recording, for errors. Converted messages are charged to `allowance`, if given."""
        self.path = path
        self._allowance = allowance
        self._of_definitions = Allowance(path)
        """Separate, because an index stays open and converts messages as long as the page shows them."""
        self.ros2: SafeStore = ros2_types()
        self._ros1: SafeStore = ros1_types()
        self._not_in_ros1: Typesdict = {}
        self._code_left = MOST_CODE
        self.unusable: dict[str, str] = {}
        """Why the definition of a type cannot be used, by the name of the type."""
        self.services: dict[str, str] = {}
        """The definitions of services, by the name of the type of their events."""
        self._accepted: set[tuple[str, bool]] = set()
        self._shapes: ShapeCheck | None = None

    def learn(self, name: str, definition: str) -> None:
        """Add a type by its ROS definition. A known type is not changed.

        If the definition does not follow the ROS grammar or is too large, the type is `unusable`.

        Raises:
            RecordingTooLarge: the name is too long, or there are too many definitions.
        """
        from kbot.record.encodings.safe_store import safe_copy  # imported lazily: rosbags is slow to import

        check_names(name)
        if name in self.ros2.fielddefs:
            return
        self._of_definitions.charge(characters=len(definition))
        try:
            found = read_definition(definition, name)
            new = {key: value for key, value in found.items() if key not in self.ros2.fielddefs}
            self._code_left -= code_cost(new)
            if self._code_left < 0:
                raise KbotError("the types of the recording are too large")
            if self._shapes is None:
                self._shapes = ShapeCheck(self.ros2.fielddefs)
                self.ros2 = safe_copy(self.ros2)
            self._shapes.add(new)
            self.ros2.register(new)
            self._not_in_ros1 |= found
            if event := next((key for key in found if key.endswith(EVENT)), ""):
                self.services[event] = definition
        except KbotError as error:
            self.unusable[name] = f"the definition of {name[:255]} cannot be used: {error}"

    @property
    def ros1(self) -> SafeStore:
        """The types as ROS 1 defines them."""
        from kbot.record.encodings.safe_store import safe_copy

        known = self._ros1.fielddefs
        new = {key: value for key, value in self._not_in_ros1.items() if key not in known}
        if new:
            self._ros1 = safe_copy(self._ros1)
            self._ros1.register(new)
        self._not_in_ros1 = {}
        return self._ros1

    def converted(self, convert: Callable[[bytes, str], memoryview], data: bytes, name: str) -> bytes:
        """Convert a message and charge it to the allowance.

        Raises:
            RecordingTooLarge: the allowance is used up.
        """
        before = self.ros2.converted_parts
        found = bytes(convert(data, name))
        if self._allowance is not None:
            self._allowance.charge(parts=self.ros2.converted_parts - before)
        return found

    def require(self, name: str, *, is_ros1: bool = False) -> None:
        """Check that a type is fully defined, and that its messages can be read in bounded time.

        Raises:
            UnusableType: it is not, or they cannot.
        """
        if (name, is_ros1) in self._accepted:
            return
        try:
            if name in self.unusable:
                raise KbotError(self.unusable[name])
            if self._shapes is not None:
                self._shapes.accept(name, is_ros1=is_ros1)
            elif name not in self.ros2.fielddefs:
                raise KbotError(f"the type {name} is not defined")
        except KbotError as error:
            raise UnusableType(f"{self.path}: {error}") from None
        self._accepted.add((name, is_ros1))


@cache
def _differing_type(name: str) -> type | None:
    """KBot's class of a type whose fields differ between ROS 1 and ROS 2, such as markers.

    None for any other type: its bytes differ only in their alignment.
    """
    kind = known_type(name)
    if kind is None or name not in ros1_types().fielddefs:
        return None
    is_same = list(_layout(ros1_types(), name)) == list(_layout(ros2_types(), name))
    return None if is_same else kind


def _layout(store: Typestore, name: str) -> Iterator[object]:
    """The kinds of a type's fields in order, with nested types replaced by their fields."""
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


class RecordedMessage(Brief):
    """A recorded message. It is `Recordable`, so it can be written to another recording."""

    def __init__(
        self,
        topic: str,
        type_name: str,
        nanoseconds: int,
        data: bytes,
        types: Types,
        *,
        is_ros1: bool = False,
        qos: str = "",
    ) -> None:
        """`qos` is the quality of service that the recording contains for the topic, in rosbag2's YAML."""
        self.topic = topic
        self.type_name = type_name
        self.nanoseconds = nanoseconds
        self.data = data
        self._types = types
        self._is_ros1 = is_ros1
        self._qos = qos

    @property
    def offered_qos(self) -> str:
        """The publisher's quality of service, as rosbag2 records it with numbers."""
        return recorded_qos(self.topic, self._qos)

    @property
    def is_latched(self) -> bool:
        """Whether the topic keeps its last message for late subscribers."""
        return is_latched(self.offered_qos)

    @property
    def place(self) -> str:
        """The file, topic and time of the message, for errors."""
        topic = self.topic if self.topic.isprintable() else repr(self.topic)
        return f"{self._types.path}: {topic} at {self.nanoseconds * 1e-9:.3f} s"

    @property
    def unusable(self) -> str:
        """Why the recording's definition of the type cannot be used, empty if it can."""
        return self._types.unusable.get(self.type_name, "")

    def with_data(self, data: bytes) -> RecordedMessage:
        """A copy of the message with other bytes."""
        return RecordedMessage(
            self.topic,
            self.type_name,
            self.nanoseconds,
            data,
            self._types,
            is_ros1=self._is_ros1,
            qos=self._qos,
        )

    @cached_property
    def cdr(self) -> bytes:
        """The message in CDR. Raises KbotError: the bytes are not a message of this type."""
        if not self._is_ros1:
            return self.data
        kind = _differing_type(self.type_name)
        if kind is not None:
            return encode_cdr(decode_ros1(self.data, kind))
        return self._converted(self._types.ros2.ros1_to_cdr)

    @cached_property
    def ros1(self) -> bytes:
        """The message in ROS 1 encoding. Raises KbotError: the bytes are not a message of this type."""
        if self._is_ros1:
            return self.data
        kind = _differing_type(self.type_name)
        if kind is not None:
            return encode_ros1(decode_cdr(self.data, kind))
        return self._converted(self._types.ros2.cdr_to_ros1)

    @property
    def ros1_definition(self) -> tuple[str, str]:
        """Text and MD5.

        Raises:
            UnusableType: the recording does not fully define the type, or ROS 1 cannot have it.
        """
        if self.type_name in self._types.services:
            raise UnusableType(f"{self._types.path}: ROS 1 has no events of services")
        text, md5 = self._defined(lambda: self._types.ros1.generate_msgdef(self.type_name))
        return text, md5

    @property
    def ros2_definition(self) -> tuple[str, str]:
        """Text and RIHS01 hash. Raises UnusableType: the recording does not fully define the type."""
        store, name = self._types.ros2, self.type_name
        service = self._types.services.get(name)  # rosbags cannot write the definitions of services
        return self._defined(
            lambda: (service or store.generate_msgdef(name, ros_version=2)[0], store.hash_rihs01(name))
        )

    def message(self) -> Any:  # noqa: ANN401 - whatever its type has
        """The message with the fields of its type. Raises KbotError: the bytes are not such a message."""
        return self._tried(
            lambda: self._types.ros2.deserialize_cdr(self.cdr, self.type_name), is_ros1=self._is_ros1
        )

    def _defined(self, define: Callable[[], tuple[str, str]]) -> tuple[str, str]:
        from rosbags.typesys import TypesysError

        self._types.require(self.type_name)
        try:
            with reading(self._types.path):
                return define()
        except (TypesysError, LookupError, AssertionError) as error:
            # rosbags cannot write definitions that contain parts of actions and services
            raise UnusableType(f"{self.place}: no definition of {self.type_name}: {error!r}") from None

    def _converted(self, convert: Callable[[bytes, str], memoryview]) -> bytes:
        found: bytes = self._tried(
            lambda: self._types.converted(convert, self.data, self.type_name), is_ros1=True
        )
        return found

    def _tried(self, read: Callable[[], Any], *, is_ros1: bool) -> Any:  # noqa: ANN401 - of the recorded type
        from rosbags.serde import SerdeError

        self._types.require(self.type_name, is_ros1=is_ros1)
        try:
            with reading(self._types.path):
                return read()
        except RecordingTooLarge as error:
            raise KbotError(f"{self.place}: {error}") from None
        except (SerdeError, LookupError, ValueError, MemoryError) as error:
            raise KbotError(f"{self.place} is not a {self.type_name}: {error}") from None

    def _shown(self) -> Iterator[str]:
        yield repr(self.topic)
        yield repr(self.type_name)
        yield f"{self.nanoseconds * 1e-9:g} s"
        yield f"{len(self.data)} bytes"
