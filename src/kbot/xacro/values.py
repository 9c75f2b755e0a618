"""The values of expressions: dotted YAML data, number literals, truth values, and safe attributes."""

from __future__ import annotations

import math
from collections.abc import Iterator

TYPE_CHECKING = False  # as in typing, which takes long to import
if TYPE_CHECKING:
    from typing import Any

    Value = Any
    """The value of an expression. The language is dynamically typed."""
else:
    Value = object


class YamlList(list[Value]):
    """A list from YAML. Its items have dotted access too."""

    def __getitem__(self, index: Value) -> Value:
        return wrap(super().__getitem__(index))

    def __iter__(self) -> Iterator[Value]:
        for item in super().__iter__():
            yield wrap(item)


class YamlDict(dict[Value, Value]):
    """A dictionary from YAML: `data.key` is `data['key']`, and both have the same error for a missing key."""

    def __getitem__(self, key: Value) -> Value:
        try:
            return wrap(super().__getitem__(key))
        except KeyError:
            raise AttributeError(f"The yaml dictionary has no key '{key}'") from None


def wrap(item: Value) -> Value:
    """An item with dotted access, as expressions see it."""
    if isinstance(item, dict):
        return YamlDict(item)
    if isinstance(item, list):
        return YamlList(item)
    return item


_LITERAL_WORDS = {"true": True, "True": True, "false": False, "False": False}
_NUMBER_STARTS = frozenset("0123456789+-.iInN \t\n\r\f\v")


def literal(value: Value) -> Value:
    """The number or truth value that a property's or parameter's text spells, or else the text.

    Quotes around a text keep it a text. So does an underscore, which Python allows in numbers.
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
        ValueError: the value is a text, but not `true`, `false` or an integer.
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
    """The names that may follow a dot after the value."""
    names = set(_PUBLIC.get(type(value), ()))
    if isinstance(value, YamlDict):
        names.update(str(key) for key in value)
    return sorted(names)


def attribute(value: Value, name: str) -> Value:
    """`value.name`, only for types and names that lead to plain data.

    Raises:
        AttributeError: there is no such attribute, or it is not allowed.
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
