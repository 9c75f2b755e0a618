"""Parameters of all bridges as messages of rcl_interfaces, and back.

`/arm/gain` is `arm.gain` of the node. What ROS 2 has no type for, as a list of lists, is not set there.
https://docs.ros.org/en/jazzy/p/rcl_interfaces/
"""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np

from kbot.ros.bridges.link import Value
from kbot.text import KbotError

Message = Any
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


def type_of(value: Value) -> int:
    """ROS 2's number for its type; that of what is not set where there is none."""
    if isinstance(value, list | tuple):
        kinds = {_type_of_one(item) for item in value} or {_STRING}
        kind = _DOUBLE if kinds == {_INTEGER, _DOUBLE} else min(kinds) if len(kinds) == 1 else NOT_SET
        return kind + _BYTES if kind != NOT_SET else NOT_SET
    return _type_of_one(value)


def message_of(value: Value) -> Message:
    """A ParameterValue."""
    kind = type_of(value)
    fields = dict(_FIELDS)
    if kind != NOT_SET:
        name, empty = _FIELDS[kind - 1]
        fields[name] = np.array(value, empty.dtype) if isinstance(empty, np.ndarray) else value
    return SimpleNamespace(type=kind, **fields)


def value_of(name: str, message: Message) -> Value:
    """None where it is to be taken away. Raises KbotError: it is of a type that is not kept."""
    if message.type == NOT_SET:
        return None
    if message.type == _BYTES or message.type > len(_FIELDS):
        kept = "booleans, numbers, texts and lists of them are"
        raise KbotError(f"{name}: a value of type {message.type} is not kept: {kept}")
    value = getattr(message, _FIELDS[message.type - 1][0])
    return value.tolist() if isinstance(value, np.ndarray) else value


def _type_of_one(value: Value) -> int:
    if isinstance(value, int) and not -(1 << 63) <= value < 1 << 63:
        return NOT_SET
    return next((number for kind, number in _KINDS if isinstance(value, kind)), NOT_SET)
