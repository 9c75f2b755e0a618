"""Checks the fields of a message before it is published, and converts the scalars and arrays of numpy.

Every transport and every recording gets its messages from the bus, which calls `checked`. So a value that
one of them could not write is refused where it is published, with the path of its field.
"""

from __future__ import annotations

import dataclasses
import math
import reprlib
from collections.abc import Callable, Iterator, Sequence
from functools import cache
from operator import attrgetter
from typing import Annotated, Any, TypeVar, get_args, get_origin, get_type_hints

import numpy as np

from kbot.text import KbotError

M = TypeVar("M")
Check = Callable[[Any], Any]
"""Returns the value of a field, converted if necessary. Raises FieldError."""

_WIDTHS = {name: np.iinfo(name) for name in ("int8", "uint8", "uint16", "int32", "uint32", "int64")}
_RANGES: dict[str, tuple[float, float]] = {
    **{name: (int(limits.min), int(limits.max)) for name, limits in _WIDTHS.items()},
    "float32": (float(np.finfo(np.float32).min), float(np.finfo(np.float32).max)),
    "float64": (-math.inf, math.inf),
}
_ANYTHING = -math.inf, math.inf
_PLAIN: dict[object, str] = {float: "float64", int: "int64", bool: "bool", str: "string", bytes: "uint8[]"}
"""The ROS type of a field whose type hint has no other."""
_NAMES = {float: "a number", int: "an integer", bool: "True or False", str: "a string"}


class FieldError(KbotError):
    """A field of a message has a value that its type does not allow."""

    def __init__(self, path: str, problem: str) -> None:
        self.path, self.problem = path, problem
        super().__init__(f"{path} {problem}")

    def within(self, outer: str) -> FieldError:
        """The same error, as one of the part `outer` of a message."""
        separator = "" if self.path.startswith("[") or not self.path else "."
        return FieldError(f"{outer}{separator}{self.path}", self.problem)


def checked(message: M) -> M:
    """The message with plain values: Python's numbers, texts and tuples, and arrays of the fields' types.

    Scalars and arrays of numpy, and lists, are converted. A message that needs no conversion is returned
    itself.

    Raises:
        FieldError: a value has the wrong type or shape, is out of range, or a list has the wrong length. It
            names the field: `Twist.linear.x must be a number, not str 'fast'`.
    """
    kind: type = type(message)
    try:
        result: M = _of_message(kind)(message)
    except FieldError as error:
        raise error.within(kind.__name__) from None
    return result


def ros_type(hint: object, name: Callable[[Any], str] = str) -> str:
    """The ROS type of a field with this type hint: `float64`, `uint8[]`, `float64[36]`.

    `name` returns the names of the types of messages.
    """
    if get_origin(hint) is Annotated:
        return str(get_args(hint)[1])
    if get_origin(hint) is np.ndarray:
        return f"{np.dtype(get_args(get_args(hint)[1])[0]).name}[]"
    if get_origin(hint) is tuple:
        return f"{ros_type(get_args(hint)[0], name)}[]"
    return _PLAIN.get(hint) or name(hint)


@cache
def _of_message(kind: type) -> Check:
    if not dataclasses.is_dataclass(kind) or not dataclasses.fields(kind):
        return lambda message: message  # not a message, or one without fields
    hints = get_type_hints(kind, include_extras=True)
    parts = [(field.name, _of_field(hints[field.name])) for field in dataclasses.fields(kind)]
    is_plain = _plain_test(kind)

    def check(message: Any) -> Any:  # noqa: ANN401 - a message of this kind
        if is_plain(message):
            return message
        changes: dict[str, object] = {}
        for name, part in parts:
            value = getattr(message, name)
            try:
                plain = part(value)
            except FieldError as error:
                raise error.within(name) from None
            if plain is not value:
                changes[name] = plain
        return dataclasses.replace(message, **changes) if changes else message

    return check


def _plain_test(kind: type) -> Callable[[object], bool]:
    """A quick test whether all values of a message are plain already, as they mostly are.

    It compares the types of all values, also those of the messages in it, at once.
    """
    paths, types = list[str](), list[object]()
    bounds, others = list[tuple[int, float, float]](), list[tuple[int, Check]]()
    for path, hint in _leaves(kind, ""):
        ros_kind, own = ros_type(hint), _own_type(hint)
        if own in (int, float) and ros_kind != "float64":
            bounds.append((len(paths), *_RANGES[ros_kind]))
        elif own is tuple or own is np.ndarray:
            others.append((len(paths), _of_field(hint)))
        paths.append(path)
        types.append(own)
    get, wanted = attrgetter(*paths, "__class__"), (*types, type)  # with two paths or more it returns a tuple

    def test(message: object) -> bool:
        try:
            values = get(message)
            if tuple(map(type, values)) != wanted:
                return False
            for index, low, high in bounds:
                if not low <= values[index] <= high:
                    return False
            for index, part in others:
                if part(values[index]) is not values[index]:
                    return False
        except (AttributeError, FieldError):
            return False
        return True

    return test


def _leaves(kind: type, prefix: str) -> Iterator[tuple[str, object]]:
    """The path and the type hint of each field of a message, and of the messages in it."""
    hints = get_type_hints(kind, include_extras=True)
    for field in dataclasses.fields(kind):
        hint, path = hints[field.name], f"{prefix}{field.name}"
        yield path, hint
        if isinstance(hint, type) and dataclasses.is_dataclass(hint):
            yield from _leaves(hint, f"{path}.")


def _own_type(hint: object) -> object:
    """The class of the plain values of a field."""
    return _own_type(get_args(hint)[0]) if get_origin(hint) is Annotated else get_origin(hint) or hint


def _of_field(hint: object) -> Check:
    kind = ros_type(hint)
    own = _own_type(hint)
    if own in _NAMES:
        return _scalar(kind)
    if own is bytes:
        return _bytes
    if own is np.ndarray:
        return _array(kind.removesuffix("[]"))
    if own is tuple:
        item, _, length = kind.removesuffix("]").partition("[")
        parts = get_args(get_args(hint)[0] if get_origin(hint) is Annotated else hint)
        return _numbers(item, int(length or -1)) if item in _RANGES else _list(_of_field(parts[0]), parts[0])
    return _message(own) if isinstance(own, type) and dataclasses.is_dataclass(own) else lambda value: value


def _message(kind: type) -> Check:
    inner = _of_message(kind)

    def check(value: Any) -> Any:  # noqa: ANN401 - any value
        if not isinstance(value, kind):
            raise FieldError("", f"must be a {kind.__name__}, not {_shown(value)}")
        return inner(value)

    return check


def _type_of(kind: str) -> type[float | str]:
    """Python's type for a ROS type of one value."""
    if kind in ("bool", "string"):
        return bool if kind == "bool" else str
    return float if kind.startswith("float") else int


def _scalar(kind: str) -> Check:
    own = _type_of(kind)
    low, high = _RANGES.get(kind, _ANYTHING)
    is_bounded = kind in _RANGES and kind != "float64"

    def check(value: Any) -> Any:  # noqa: ANN401 - any value
        if type(value) is not own:
            value = _converted(value, own)
        if is_bounded and not low <= value <= high and (own is int or math.isfinite(value)):
            raise _outside(kind, value)
        return value

    return check


def _outside(kind: str, value: object, path: str = "") -> FieldError:
    low, high = (f"{limit:.6g}" if kind == "float32" else f"{limit}" for limit in _RANGES[kind])
    return FieldError(path, f"must be from {low} to {high} ({kind}), not {reprlib.repr(value)}")


def _converted(value: Any, own: type) -> Any:  # noqa: ANN401 - any value
    """A value of another class as one of Python's own classes, if it has that meaning."""
    given = value
    if isinstance(value, np.generic) or (isinstance(value, np.ndarray) and value.ndim == 0):
        value = value.item()
    accepted = (int, float, np.floating) if own is float else own  # numpy's own long floats remain
    if isinstance(value, accepted) and (own is bool or not isinstance(value, bool)):
        try:
            return own(value)
        except OverflowError:
            raise FieldError("", f"must be a number below 1.8e308, not {reprlib.repr(value)}") from None
    raise FieldError("", f"must be {_NAMES[own]}, not {_shown(given)}")


def _bytes(value: Any) -> bytes:  # noqa: ANN401 - any value
    if type(value) is bytes:
        return value
    if isinstance(value, np.ndarray) and value.dtype == np.uint8:
        return value.tobytes()
    if isinstance(value, bytes | bytearray | memoryview):
        return bytes(value)
    if isinstance(value, Sequence) and not isinstance(value, str):
        try:
            return bytes(value)
        except (TypeError, ValueError):
            raise FieldError("", "must be bytes or numbers from 0 to 255") from None
    hint = ": append .tobytes() to write its memory" if isinstance(value, np.ndarray) else ""
    raise FieldError("", f"must be bytes or an array of uint8, not {_shown(value)}{hint}")


def _array(kind: str) -> Check:
    own, (low, high) = np.dtype(kind), _RANGES[kind]

    def check(value: Any) -> Any:  # noqa: ANN401 - any value
        given = _one_dimension(value)
        if given.dtype == own:
            return given
        if given.dtype.kind not in ("iuf" if own.kind == "f" else "iu") and given.size:
            raise FieldError("", f"must have numbers of type {kind}, not {_shown(value)}")
        with np.errstate(over="ignore"):
            array = given.astype(own)
        outside = (
            np.isfinite(given) & ~np.isfinite(array) if own.kind == "f" else (given < low) | (given > high)
        )
        if outside.any():
            at = int(np.argmax(outside))
            raise FieldError(f"[{at}]", f"must be from {low:g} to {high:g} ({kind}), not {given[at]}")
        return array

    return check


def _one_dimension(value: Any) -> Any:  # noqa: ANN401 - any value
    """An array with one dimension, the value itself if it is one."""
    if not isinstance(value, np.ndarray):
        if isinstance(value, str | bytes) or not isinstance(value, Sequence):
            raise FieldError("", f"must be an array or a list, not {_shown(value)}")
        try:
            value = np.array(value)
        except ValueError:
            raise FieldError("", "must be an array or a list of numbers, all in one dimension") from None
    if value.ndim != 1:
        raise FieldError("", f"must have one dimension, not the shape {value.shape}")
    return value


def _numbers(kind: str, length: int) -> Check:
    """A tuple of `length` numbers, or of any length if it is -1."""
    own, (low, high), item = _type_of(kind), _RANGES[kind], _scalar(kind)
    last: object = item  # the last value that needed no conversion: none yet, as no value is a check

    def check(value: Any) -> Any:  # noqa: ANN401 - any value
        nonlocal last
        if value is last:
            return value
        values = value if type(value) is tuple else _as_tuple(value, own)
        if length not in (-1, len(values)):
            raise FieldError("", f"must have {length} numbers, not {len(values)}")
        is_plain = set(map(type, values)) <= {own}
        if not (is_plain and (not values or (low <= min(values) and max(values) <= high))):
            values = _each(item, values)
        last = values  # a covariance is often the same object in every message
        return values

    return check


def _list(item: Check, hint: object) -> Check:
    own = _own_type(hint)

    def check(value: Any) -> Any:  # noqa: ANN401 - any value
        values = value if type(value) is tuple else _as_tuple(value, own)
        return _each(item, values)

    return check


def _as_tuple(value: Any, own: object) -> tuple[Any, ...]:  # noqa: ANN401 - any value
    if isinstance(value, np.ndarray):
        array = _one_dimension(value)
        return tuple((array.astype(float) if own is float and array.dtype.kind in "iu" else array).tolist())
    if isinstance(value, Sequence) and not isinstance(value, str | bytes):
        return tuple(value)
    raise FieldError("", f"must be a list, not {_shown(value)}")


def _each(item: Check, values: tuple[Any, ...]) -> tuple[Any, ...]:
    """The values after the check of each. The tuple itself if none changes."""
    plain = []
    for index, value in enumerate(values):
        try:
            plain.append(item(value))
        except FieldError as error:
            raise error.within(f"[{index}]") from None
    return values if all(map(lambda new, old: new is old, plain, values)) else tuple(plain)


def _shown(value: object) -> str:
    if value is None:
        return "None"
    if isinstance(value, np.ndarray):
        return f"an array of {value.dtype} with the shape {value.shape}"
    return f"{type(value).__name__} {reprlib.repr(value)}"
