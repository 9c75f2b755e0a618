"""The parameter services of a ROS 2 node, for the parameters that all bridges share.

A parameter has no fixed type: it can be set to a value of another type.
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
from kbot.ros.bridges.zenoh.names import PARAMETERS
from kbot.ros.bridges.zenoh.queryables import Served
from kbot.ros.parameter_values import ParameterValue
from kbot.ros.service_types import hash_of_service
from kbot.text import KbotError

if TYPE_CHECKING:
    from rosbags.typesys.store import Typestore


Message = Any  # Any: rosbags makes the classes
"""A message of rcl_interfaces, of a class of rosbags."""

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
"""The fields of a ParameterValue, with their defaults, in the order of its types from 1 on."""

NOT_SET = 0
_INTEGER, _DOUBLE, _STRING, _BYTES = 2, 3, 4, 5
_KINDS = (bool, 1), (int, _INTEGER), (float, _DOUBLE), (str, _STRING)
"""Python's and ROS 2's types. The first match counts, because bool is a subclass of int. The type of a list
is `_BYTES` above that of its items."""


def dotted(name: str) -> str:
    """The ROS 2 name of a parameter: `/arm/gain` is `arm.gain`."""
    return name.strip("/").replace("/", ".")


def type_of(value: ParameterValue) -> int:
    """The number of the value's type in ROS 2, NOT_SET if ROS 2 has no such type."""
    if isinstance(value, list | tuple):
        kinds = {_type_of_item(item) for item in value} or {_STRING}
        kind = _DOUBLE if kinds == {_INTEGER, _DOUBLE} else min(kinds) if len(kinds) == 1 else NOT_SET
        return kind + _BYTES if kind != NOT_SET else NOT_SET
    return _type_of_item(value)


def message_of(value: ParameterValue) -> Message:
    """The ParameterValue message of a value."""
    kind = type_of(value)
    fields = dict(_FIELDS)
    if kind != NOT_SET:
        name, empty = _FIELDS[kind - 1]
        fields[name] = np.array(value, empty.dtype) if isinstance(empty, np.ndarray) else value
    return SimpleNamespace(type=kind, **fields)


def value_of(name: str, message: Message) -> ParameterValue:
    """The value of a ParameterValue message; None deletes the parameter. Raises KbotError: it is bytes."""
    if message.type == NOT_SET:
        return None
    if message.type == _BYTES or message.type > len(_FIELDS):
        allowed = "use a boolean, a number, a string or a list of these"
        raise KbotError(f"{name}: a value of type {message.type} is not supported: {allowed}")
    value: ParameterValue = getattr(message, _FIELDS[message.type - 1][0])
    return value.tolist() if isinstance(value, np.ndarray) else value


def _type_of_item(value: ParameterValue) -> int:
    if isinstance(value, int) and not -(1 << 63) <= value < 1 << 63:
        return NOT_SET
    return next((number for kind, number in _KINDS if isinstance(value, kind)), NOT_SET)


TOPIC, TYPE = "/parameter_events", "rcl_interfaces/msg/ParameterEvent"


class ParameterEvents:
    """Publishes changes of a link's parameters since its creation. `put` sends a message in CDR."""

    def __init__(self, link: PeerLink, node: str, put: Callable[[bytes], None]) -> None:
        self._link, self._node, self._put = link, node, put
        self._published = _typed(link)

    def publish_changes(self) -> None:
        """Publish what has changed since the last call."""
        before, now = self._published, _typed(self._link)
        if now == before:
            return
        self._published = now
        event = SimpleNamespace(
            stamp=Time.from_nanoseconds(self._link.nanoseconds),
            node=self._node,
            new_parameters=_messages({name: now[name] for name in now.keys() - before.keys()}),
            changed_parameters=_messages(
                {name: now[name] for name in now.keys() & before.keys() if now[name] != before[name]}
            ),
            deleted_parameters=_messages({name: before[name] for name in before.keys() - now.keys()}),
        )
        with suppress(ValueError):  # a string that cannot be encoded in UTF-8
            self._put(bytes(ros2_types().serialize_cdr(event, TYPE)))


def _typed(link: PeerLink) -> dict[str, ParameterValue]:
    """The parameters that have a type in ROS 2, by their ROS 2 names."""
    return {dotted(full): value for full, value in link.parameters.items() if type_of(value) != NOT_SET}


def _messages(values: dict[str, ParameterValue]) -> list[Message]:
    return [SimpleNamespace(name=name, value=message_of(values[name])) for name in sorted(values)]


MOST_AT_ONCE = 1000
"""Parameters in one call."""

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
"""The fields of the request and of the response of each service."""


def parameter_services(link: PeerLink, node: str) -> list[Served]:
    """The parameter services of the node with this full name."""
    handlers = _Handlers(link)
    return [_served(f"{node}/{name}", name, getattr(handlers, name)) for name in _SERVICES]


def _served(name: str, service: str, work: Callable[[Message], Message]) -> Served:
    from rosbags.serde import SerdeError  # imported lazily: rosbags is slow to import

    store = _types()
    short, request, response = _type_names(service)
    fields = (dict(store.fielddefs[part][1]) for part in (request, response))

    def call(payload: bytes) -> Future[Message]:
        try:
            message = store.deserialize_cdr(payload, request)
        except (SerdeError, LookupError, ValueError, MemoryError) as error:
            raise KbotError(f"{len(payload)} bytes are not a {request}: {error}") from None
        done: Future[Message] = Future()
        done.set_result(store.types[response](work(message)))
        return done

    def encode(message: Message) -> bytes:
        try:
            return bytes(store.serialize_cdr(message, response))
        except (SerdeError, ValueError) as error:  # for example, a string that is not valid Unicode
            raise KbotError(f"the {response} cannot be encoded: {error}") from None

    type_name = f"rcl_interfaces/srv/{short}"
    return Served(name, type_name, hash_of_service(type_name, *fields), call, encode, PARAMETERS)


@cache
def _types() -> Typestore:
    """The type store of all bridges, with the types of the parameter services."""
    from rosbags.typesys import get_types_from_msg

    store = ros2_types()
    for service, texts in _SERVICES.items():
        for name, text in zip(_type_names(service)[1:], texts, strict=True):
            store.register(get_types_from_msg(text, name))
    return store


def _type_names(service: str) -> tuple[str, str, str]:
    """The names of a service's type, without its package, and of its request and response."""
    short = "".join(word.title() for word in service.split("_"))
    return short, f"rcl_interfaces/msg/{short}_Request", f"rcl_interfaces/msg/{short}_Response"


class _Handlers:
    """A method for each service. It gets the request and returns the only field of the response."""

    def __init__(self, link: PeerLink) -> None:
        self._link = link
        self._cache: tuple[dict[str, ParameterValue], dict[str, str]] = {}, {}
        """The link's parameters, and the names computed from them."""

    def list_parameters(self, request: Message) -> Message:
        """Prefixes and depth have the meaning of rclcpp. A depth of 0 is unlimited."""
        prefixes = tuple(f"{prefix}." for prefix in _limited(request.prefixes)) or ("",)
        names: list[str] = []
        for name in self._names():
            below = [name[len(p) :].count(".") for p in prefixes if f"{name}.".startswith(p)]
            if below and (not request.depth or min(below) < request.depth):
                names.append(name)
        folders = dict.fromkeys(name.rpartition(".")[0] for name in names if "." in name)
        return SimpleNamespace(names=names, prefixes=list(folders))

    def get_parameters(self, request: Message) -> Message:
        return [message_of(self._value(name)) for name in _limited(request.names)]

    def get_parameter_types(self, request: Message) -> Message:
        return np.array([type_of(self._value(name)) for name in _limited(request.names)], np.uint8)

    def describe_parameters(self, request: Message) -> Message:
        return [_description(name, type_of(self._value(name))) for name in _limited(request.names)]

    def set_parameters(self, request: Message) -> Message:
        return [self._set([parameter]) for parameter in _limited(request.parameters)]

    def set_parameters_atomically(self, request: Message) -> Message:
        return self._set(_limited(request.parameters))

    def _set(self, parameters: list[Message]) -> Message:
        """Set all of them, or none."""
        try:
            values = {self._full(p.name): value_of(p.name, p.value) for p in parameters}
        except KbotError as error:
            return SimpleNamespace(successful=False, reason=str(error))
        self._link.set_parameters(values)
        return SimpleNamespace(successful=True, reason="")

    def _names(self) -> dict[str, str]:
        """The full name of each parameter that has a type in ROS 2, by its ROS 2 name."""
        seen, names = self._cache
        values = self._link.parameters
        if values is not seen:
            names = {dotted(full): full for full, value in values.items() if type_of(value) != NOT_SET}
            self._cache = values, names
        return names

    def _value(self, name: str) -> ParameterValue:
        return self._link.parameters.get(self._names().get(dotted(name), ""))

    def _full(self, name: str) -> str:
        key = dotted(name)
        if not key:
            raise KbotError("the parameter has no name")
        return self._names().get(key) or f"/{key.replace('.', '/')}"


def _limited(items: list[Message]) -> list[Message]:
    """The items. Raises KbotError: there are too many."""
    if len(items) > MOST_AT_ONCE:
        raise KbotError(f"{len(items)} parameters in one call: at most {MOST_AT_ONCE} are allowed")
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
