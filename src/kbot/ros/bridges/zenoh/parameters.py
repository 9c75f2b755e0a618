"""The parameter services of a ROS 2 node, over the values that all bridges share.

Values keep no type: any may be set to one of another.
"""

from __future__ import annotations

from collections.abc import Callable
from concurrent.futures import Future
from contextlib import suppress
from functools import cache
from types import SimpleNamespace
from typing import TYPE_CHECKING, Any

import numpy as np

from kbot.messages.types import Time
from kbot.record.encodings.types import ros2_types
from kbot.ros.bridges.link import PeerLink
from kbot.ros.bridges.zenoh.names import OF_PARAMETERS
from kbot.ros.bridges.zenoh.queryables import Served
from kbot.ros.parameter_values import ParameterValue
from kbot.ros.service_types import hash_of_service
from kbot.text import KbotError

if TYPE_CHECKING:
    from rosbags.typesys.store import Typestore


Message = Any  # Any: rosbags makes the classes
"""One of rcl_interfaces, as the library has them."""

_FIELDS: tuple[tuple[str, Any], ...] = (
    ("bool_value", False),
    ("integer_value", 0),
    ("double_value", 0.0),
    ("string_value", ""),
    ("byte_array_value", np.empty(0, np.uint8)),
    ("bool_array_value", np.empty(0, np.bool_)),
    ("integer_array_value", np.empty(0, np.int64)),
    ("double_array_value", np.empty(0, np.float64)),
    ("string_array_value", []),
)
"""Where a ParameterValue has its value, by its type from 1 on, and what stands there else."""

NOT_SET = 0
_INTEGER, _DOUBLE, _STRING, _BYTES = 2, 3, 4, 5
_KINDS = (bool, 1), (int, _INTEGER), (float, _DOUBLE), (str, _STRING)
"""The first that a value is of gives its type; a list's is that of its items and `_BYTES` further."""


def dotted(name: str) -> str:
    return name.strip("/").replace("/", ".")


def type_of(value: ParameterValue) -> int:
    """ROS 2's number for its type; that of what is not set where there is none."""
    if isinstance(value, list | tuple):
        kinds = {_type_of_one(item) for item in value} or {_STRING}
        kind = _DOUBLE if kinds == {_INTEGER, _DOUBLE} else min(kinds) if len(kinds) == 1 else NOT_SET
        return kind + _BYTES if kind != NOT_SET else NOT_SET
    return _type_of_one(value)


def message_of(value: ParameterValue) -> Message:
    """A ParameterValue."""
    kind = type_of(value)
    fields = dict(_FIELDS)
    if kind != NOT_SET:
        name, empty = _FIELDS[kind - 1]
        fields[name] = np.array(value, empty.dtype) if isinstance(empty, np.ndarray) else value
    return SimpleNamespace(type=kind, **fields)


def value_of(name: str, message: Message) -> ParameterValue:
    """None where it is to be taken away. Raises KbotError: it is of a type that is not kept."""
    if message.type == NOT_SET:
        return None
    if message.type == _BYTES or message.type > len(_FIELDS):
        kept = "booleans, numbers, texts and lists of them are"
        raise KbotError(f"{name}: a value of type {message.type} is not kept: {kept}")
    value: ParameterValue = getattr(message, _FIELDS[message.type - 1][0])
    return value.tolist() if isinstance(value, np.ndarray) else value


def _type_of_one(value: ParameterValue) -> int:
    if isinstance(value, int) and not -(1 << 63) <= value < 1 << 63:
        return NOT_SET
    return next((number for kind, number in _KINDS if isinstance(value, kind)), NOT_SET)


TOPIC, TYPE = "/parameter_events", "rcl_interfaces/msg/ParameterEvent"


class ParameterEvents:
    """Of the parameters that a link has, from the moment this is made; `put` sends a message in CDR."""

    def __init__(self, link: PeerLink, node: str, put: Callable[[bytes], None]) -> None:
        self._link, self._node, self._put = link, node, put
        self._told = _known(link)

    def tell(self) -> None:
        """Say what changed since the last time."""
        before, now = self._told, _known(self._link)
        if now == before:
            return
        self._told = now
        event = SimpleNamespace(
            stamp=Time.from_nanoseconds(self._link.nanoseconds),
            node=self._node,
            new_parameters=_messages({name: now[name] for name in now.keys() - before.keys()}),
            changed_parameters=_messages(
                {name: now[name] for name in now.keys() & before.keys() if now[name] != before[name]}
            ),
            deleted_parameters=_messages({name: before[name] for name in before.keys() - now.keys()}),
        )
        with suppress(ValueError):  # a text that is no Unicode
            self._put(bytes(ros2_types().serialize_cdr(event, TYPE)))


def _known(link: PeerLink) -> dict[str, ParameterValue]:
    return {dotted(full): value for full, value in link.parameters.items() if type_of(value) != NOT_SET}


def _messages(values: dict[str, ParameterValue]) -> list[Message]:
    return [SimpleNamespace(name=name, value=message_of(values[name])) for name in sorted(values)]


MOST_AT_ONCE = 1000
"""Parameters of one call."""

_SERVICES = {
    "list_parameters": ("string[] prefixes\nuint64 depth", "rcl_interfaces/ListParametersResult result"),
    "get_parameters": ("string[] names", "rcl_interfaces/ParameterValue[] values"),
    "get_parameter_types": ("string[] names", "uint8[] types"),
    "describe_parameters": ("string[] names", "rcl_interfaces/ParameterDescriptor[] descriptors"),
    "set_parameters": (
        "rcl_interfaces/Parameter[] parameters",
        "rcl_interfaces/SetParametersResult[] results",
    ),
    "set_parameters_atomically": (
        "rcl_interfaces/Parameter[] parameters",
        "rcl_interfaces/SetParametersResult result",
    ),
}
"""Each with the fields of its request and of its response."""


def parameter_services(link: PeerLink, node: str) -> list[Served]:
    """The services of a node, by its full name."""
    asked = _Parameters(link)
    return [_served(f"{node}/{name}", name, getattr(asked, name)) for name in _SERVICES]


def _served(name: str, service: str, work: Callable[[Message], Message]) -> Served:
    from rosbags.serde import SerdeError  # lazy in this module: rosbags takes start-up time

    store = _types()
    short, request, response = _type_names(service)
    fields = (dict(store.fielddefs[part][1]) for part in (request, response))

    def call(payload: bytes) -> Future[Message]:
        try:
            asked = store.deserialize_cdr(payload, request)
        except (SerdeError, LookupError, ValueError, MemoryError) as error:
            raise KbotError(f"{len(payload)} bytes are no {request}: {error}") from None
        done: Future[Message] = Future()
        done.set_result(store.types[response](work(asked)))
        return done

    def encode(message: Message) -> bytes:
        try:
            return bytes(store.serialize_cdr(message, response))
        except (SerdeError, ValueError) as error:  # as of a text that is no Unicode
            raise KbotError(f"no {response}: {error}") from None

    type_name = f"rcl_interfaces/srv/{short}"
    return Served(name, type_name, hash_of_service(type_name, *fields), call, encode, OF_PARAMETERS)


@cache
def _types() -> Typestore:
    """Those of all bridges, and the services' own."""
    from rosbags.typesys import get_types_from_msg

    store = ros2_types()
    for service, texts in _SERVICES.items():
        for name, text in zip(_type_names(service)[1:], texts, strict=True):
            store.register(get_types_from_msg(text, name))
    return store


def _type_names(service: str) -> tuple[str, str, str]:
    """Of a service its own, without its package, its request's and its response's."""
    short = "".join(word.title() for word in service.split("_"))
    return short, f"rcl_interfaces/msg/{short}_Request", f"rcl_interfaces/msg/{short}_Response"


class _Parameters:
    """Each service's work: of its request the one field of its response."""

    def __init__(self, link: PeerLink) -> None:
        self._link = link
        self._known: tuple[dict[str, ParameterValue], dict[str, str]] = {}, {}

    def list_parameters(self, request: Message) -> Message:
        """As rclcpp understands prefixes, and a depth, of which 0 is without end."""
        prefixes = tuple(f"{prefix}." for prefix in _few(request.prefixes)) or ("",)
        names: list[str] = []
        for name in self._names():
            below = [name[len(p) :].count(".") for p in prefixes if f"{name}.".startswith(p)]
            if below and (not request.depth or min(below) < request.depth):
                names.append(name)
        folders = dict.fromkeys(name.rpartition(".")[0] for name in names if "." in name)
        return SimpleNamespace(names=names, prefixes=list(folders))

    def get_parameters(self, request: Message) -> Message:
        return [message_of(self._value(name)) for name in _few(request.names)]

    def get_parameter_types(self, request: Message) -> Message:
        return np.array([type_of(self._value(name)) for name in _few(request.names)], np.uint8)

    def describe_parameters(self, request: Message) -> Message:
        return [_description(name, type_of(self._value(name))) for name in _few(request.names)]

    def set_parameters(self, request: Message) -> Message:
        return [self._set([parameter]) for parameter in _few(request.parameters)]

    def set_parameters_atomically(self, request: Message) -> Message:
        return self._set(_few(request.parameters))

    def _set(self, parameters: list[Message]) -> Message:
        """All of them, or none."""
        try:
            values = {self._full(p.name): value_of(p.name, p.value) for p in parameters}
        except KbotError as error:
            return SimpleNamespace(successful=False, reason=str(error))
        self._link.set_parameters(values)
        return SimpleNamespace(successful=True, reason="")

    def _names(self) -> dict[str, str]:
        """The full name of each that ROS 2 has a type for."""
        seen, names = self._known
        values = self._link.parameters
        if values is not seen:
            names = {dotted(full): full for full, value in values.items() if type_of(value) != NOT_SET}
            self._known = values, names
        return names

    def _value(self, name: str) -> ParameterValue:
        return self._link.parameters.get(self._names().get(dotted(name), ""))

    def _full(self, name: str) -> str:
        key = dotted(name)
        if not key:
            raise KbotError("a parameter needs a name")
        return self._names().get(key) or f"/{key.replace('.', '/')}"


def _few(items: list[Message]) -> list[Message]:
    if len(items) > MOST_AT_ONCE:
        raise KbotError(f"{len(items)} parameters in one call: at most {MOST_AT_ONCE} are answered for")
    return items


def _description(name: str, kind: int) -> Message:
    return SimpleNamespace(
        name=name,
        type=kind,
        description="",
        additional_constraints="",
        read_only=False,
        dynamic_typing=True,
        floating_point_range=[],
        integer_range=[],
    )
