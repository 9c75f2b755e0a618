"""The values of expressions: dotted YAML data, number literals, booleans, and safe attributes."""

from __future__ import annotations

import math
from collections.abc import Iterator

TYPE_CHECKING = False  # as in typing, which takes long to import
if TYPE_CHECKING:
    from typing import Any

    Value = Any
    """What an expression computes; the language is dynamically typed."""
else:
    Value = object


class YamlList(list[Value]):
    """A list from YAML: its items give dotted access too."""

    def __getitem__(self, index: Value) -> Value:
        return wrap(super().__getitem__(index))

    def __iter__(self) -> Iterator[Value]:
        for item in super().__iter__():
            yield wrap(item)


class YamlDict(dict[Value, Value]):
    """A dictionary from YAML: `data.key` is `data['key']`, and a missing key has the same error."""

    def __getitem__(self, key: Value) -> Value:
        try:
            return wrap(super().__getitem__(key))
        except KeyError:
            raise AttributeError(f"The yaml dictionary has no key '{key}'") from None


def wrap(item: Value) -> Value:
    """An item as it is seen from an expression."""
    if isinstance(item, dict):
        return YamlDict(item)
    if isinstance(item, list):
        return YamlList(item)
    return item


_LITERAL_WORDS = {"true": True, "True": True, "false": False, "False": False}
_NUMBER_STARTS = frozenset("0123456789+-.iInN \t\n\r\f\v")


def literal(value: Value) -> Value:
    """A property's or parameter's text as the number or truth value it spells, or itself.

    Quotes around keep it a string; so does an underscore, which Python would take in a number.
    """
    if type(value) is not str:
        return value
    if len(value) >= 2 and value[0] == "'" and value[-1] == "'":
        return value[1:-1]
    if not value or (value[0] not in _NUMBER_STARTS and value[0].isascii()):
        return _LITERAL_WORDS.get(value, value)
    if "_" in value:
        return value
    for kind in (float,) if "." in value else (int, float):
        try:
            return kind(value)
        except ValueError:
            pass
    return value


def truth(value: Value) -> bool:
    """The truth value of a condition.

    Raises:
        ValueError: a text that is neither `true`, `false` nor a whole number.
    """
    if isinstance(value, str):
        known = _LITERAL_WORDS.get(value)
        return bool(int(value)) if known is None else known
    return bool(value)


_PUBLIC: dict[type, frozenset[str]] = {
    kind: frozenset(name for name in dir(kind) if not name.startswith("_"))
    for kind in (str, bytes, int, float, complex, list, tuple, dict, set, frozenset, range, slice)
}
_PUBLIC[bool] = _PUBLIC[int]
_PUBLIC[YamlDict] = _PUBLIC[dict]
_PUBLIC[YamlList] = _PUBLIC[list]
TYPES = frozenset(_PUBLIC)


def public_names(value: Value) -> list[str]:
    """Names that may follow a dot behind the value."""
    names = set(_PUBLIC.get(type(value), ()))
    if isinstance(value, YamlDict):
        names.update(str(key) for key in value)
    return sorted(names)


def attribute(value: Value, name: str) -> Value:
    """`value.name`, for the types and names that lead nowhere but to data.

    Raises:
        AttributeError: there is no such attribute, or it is out of bounds.
    """
    kind = type(value)
    if name in _PUBLIC.get(kind, ()):
        return getattr(value, name)
    if kind is YamlDict:
        return value[name]
    if kind is type and value in TYPES and name in _PUBLIC[value]:
        return getattr(value, name)
    own = getattr(value, "xacro_attribute", None)
    if own is not None:
        return own(name)
    raise AttributeError(f"'{kind.__name__}' object has no attribute '{name}'")


def is_number(value: Value) -> bool:
    return isinstance(value, int | float) and not (isinstance(value, float) and math.isnan(value))
