"""Converts messages to plain values (dictionaries, lists, numbers, text) for JSON, and back."""

from __future__ import annotations

import base64
import dataclasses
import json
import math
from collections.abc import Callable, Iterable
from functools import cache
from typing import Any, get_args, get_origin, get_type_hints

import numpy as np
import orjson
from numpy.typing import NDArray

from kbot.messages.types import Time
from kbot.record.encodings.type_names import ros_name
from kbot.text import KbotError
from kbot.text.suggest import did_you_mean

Plain = Any  # Any: JSON
ROS1_TIME = {"secs": "sec", "nsecs": "nanosec"}


def to_plain(message: object, *, ros1: bool = False, exact: bool = False) -> Plain:
    """The fields of a message by name.

    NaN and infinity, which JSON lacks, become None unless `exact`. Bytes become Base64. With `ros1`, times
    have the fields `secs` and `nsecs`.
    """
    kind: type = type(message)
    return _reader(kind, ros1, exact)(message)


def to_json(message: object, *, ros1: bool = False, exact: bool = False) -> str:
    """`to_plain` as JSON. With `exact`, NaN and infinity are written as NaN and Infinity."""
    plain = to_plain(message, ros1=ros1, exact=True)
    try:
        text = orjson.dumps(plain, option=orjson.OPT_SERIALIZE_NUMPY).decode()
    except TypeError:  # a string that is not valid Unicode
        return json.dumps(to_plain(message, ros1=ros1, exact=exact))
    # orjson writes null for NaN and infinity
    return json.dumps(plain) if exact and "null" in text else text


@cache
def _reader(kind: type, ros1: bool, exact: bool) -> Callable[[Any], Plain]:
    """The function that converts values of a type. Cached, so that type hints are not read for each
    message."""
    if kind is Time and ros1:
        return lambda time: {"secs": time.sec, "nsecs": time.nanosec}
    if dataclasses.is_dataclass(kind):
        hints = get_type_hints(kind)
        parts = [(f.name, _part(hints[f.name], ros1, exact)) for f in dataclasses.fields(kind)]
        return lambda message: {
            name: part(getattr(message, name)) if part else getattr(message, name) for name, part in parts
        }
    if issubclass(kind, tuple | list):
        return lambda items: [to_plain(item, ros1=ros1, exact=exact) for item in items]
    if issubclass(kind, bytes):
        return lambda data: base64.b64encode(data).decode()
    if issubclass(kind, np.ndarray):
        return _same_list if exact else _finite_list
    return _finite if issubclass(kind, float) and not exact else _same


def _part(hint: object, ros1: bool, exact: bool) -> Callable[[Any], Plain] | None:
    """The function that converts a field with a type hint. None if its values are already plain.

    A value may still have another type, such as an int in a float field.
    """
    if dataclasses.is_dataclass(hint) and isinstance(hint, type):
        return _reader(hint, ros1, exact)
    if hint is float:
        return None if exact else _finite
    if hint in (int, bool, str):
        return None
    if hint == tuple[float, ...]:
        return list if exact else _finite_items
    if hint == tuple[str, ...]:
        return list
    return lambda value: to_plain(value, ros1=ros1, exact=exact)


def _same(value: Plain) -> Plain:
    return value


def _finite(value: float) -> float | None:
    return value if math.isfinite(value) else None


def _finite_items(values: Iterable[float]) -> list[float | None]:
    return [value if math.isfinite(value) else None for value in values]


def _same_list(array: NDArray[Any]) -> Plain:
    return array.tolist()


def _finite_list(array: NDArray[Any]) -> Plain:
    values = array.tolist()
    if array.dtype.kind != "f" or np.isfinite(array).all():
        return values
    return _finite_items(values) if array.ndim == 1 else [_finite_list(row) for row in array]


def from_plain(value: Plain, message_type: type) -> Plain:
    """Create a message from fields by name. Missing fields keep their defaults.

    Raises:
        KbotError: a field is unknown, or a value has the wrong type.
    """
    try:
        return _maker(message_type)(value)
    except (TypeError, ValueError, AttributeError, OverflowError) as error:
        raise KbotError(f"not a {_name(message_type)}: {error}") from None


def _name(message_type: type) -> str:
    """The ROS name of a type. A part of a service has no ROS name, so its class name is used."""
    try:
        return ros_name(message_type)
    except KbotError:
        return message_type.__name__


@cache
def _maker(message_type: type) -> Callable[[Plain], Any]:
    hints = get_type_hints(message_type)
    makers = {field.name: _value(hints[field.name]) for field in dataclasses.fields(message_type)}
    name = _name(message_type)

    def make(value: Plain) -> object:
        if not isinstance(value, dict):
            raise TypeError(f"{name} needs fields by name, not {_kind(value)}")
        if message_type is Time:
            value = {ROS1_TIME.get(key, key): item for key, item in value.items()}
        for key in value.keys() - makers.keys() - {"seq"}:
            hint = did_you_mean(str(key), makers)
            raise TypeError(f"{name} has no field '{key}'" + (f": {hint}" if hint else ""))
        return message_type(**{key: makers[key](item) for key, item in value.items() if key in makers})

    return make


def _value(hint: object) -> Callable[[Plain], Any]:
    if dataclasses.is_dataclass(hint) and isinstance(hint, type):
        return _maker(hint)
    if hint is float:
        return _number
    if hint in (int, bool, str):
        return lambda value: _exactly(value, hint)
    if hint is bytes:
        return lambda value: base64.b64decode(value) if isinstance(value, str) else bytes(value)
    if get_origin(hint) is np.ndarray:
        dtype = get_args(get_args(hint)[1])[0]
        return lambda value: np.array([_number(item) for item in _exactly(value, list)]).astype(dtype)
    item = _value(next(arg for arg in get_args(hint) if arg is not Ellipsis))
    return lambda value: tuple(item(part) for part in _exactly(value, list))


def _number(value: Plain) -> float:
    if value is None:
        return math.nan
    if isinstance(value, bool) or not isinstance(value, int | float):
        raise TypeError(f"a number is expected, not {_kind(value)}")
    return float(value)


def _exactly(value: Plain, kind: type) -> Plain:
    if not isinstance(value, kind) or (kind is int and isinstance(value, bool)):
        raise TypeError(f"a value of type {kind.__name__} is expected, not {_kind(value)}")
    return value


def _kind(value: Plain) -> str:
    return "nothing" if value is None else f"{type(value).__name__} {str(value)[:40]!r}"
