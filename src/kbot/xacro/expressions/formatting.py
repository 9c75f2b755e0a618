"""Formats text (`str.format`, `%`, f-strings) after checking the size of the result."""

from __future__ import annotations

import re

from kbot.xacro.budget import Budget
from kbot.xacro.values import Value, attribute

TYPE_CHECKING = False
if TYPE_CHECKING:
    from collections.abc import Iterable, Sequence

_WIDTH = re.compile(r"\d+|\*")
_FIELD_STEPS = 8
"""Steps charged for a replacement field, which `string.Formatter` takes for it."""
_NUMBER = 400
"""Characters of the longest number that `%f` writes without a width or precision."""
_ESCAPE = 10
"""Characters that `%r` and `%a` write at most for one character of a text."""


def percent(budget: Budget, pattern: str | bytes, values: Value) -> Value:
    """`pattern % values`."""
    text = pattern if isinstance(pattern, str) else pattern.decode("latin-1")
    budget.measure(text)
    factor = _ESCAPE if "r" in text or "a" in text else 1
    items: Iterable[Value] = (values,)
    if isinstance(values, tuple):
        items = values
    elif isinstance(values, dict):
        items = dict.values(values)
    sizes = [_size(budget, item, factor) for item in items]
    # each item of a tuple is used once; with a dictionary, every field can write the longest value
    size = sum(sizes) if isinstance(values, tuple) else max(sizes, default=0) * text.count("%")
    _check(budget, size + _widths(budget, text, [item for item in items if isinstance(item, int)]))
    return pattern % values


def _size(budget: Budget, value: Value, factor: int) -> int:
    """The number of characters that `%` writes at most for a value."""
    if isinstance(value, str | bytes):
        return len(value) * factor
    return max(len(budget.text(value)), _NUMBER) * factor


def _widths(budget: Budget, pattern: str, stars: Sequence[int] = ()) -> int:
    """The sum of all widths and precisions in a pattern. A `*` counts as the largest of `stars`."""
    size, star = 0, max(map(abs, stars), default=0)
    for match in _WIDTH.finditer(pattern):
        width = match[0]
        budget.charge(1)
        budget.length(len(width))
        size += star if width == "*" else int(width) if len(width) < 10 else budget.limits.length + 1
    return size


def _check(budget: Budget, size: int) -> None:
    budget.length(size)
    budget.charge(size >> 4)


def format_value(budget: Budget, value: Value, spec: str) -> str:
    """`format(value, spec)`."""
    if spec:
        _check(budget, _widths(budget, spec))
    if type(value) is not str:
        budget.weigh(value)
    return budget.checked(format(value, spec))  # type: ignore[no-any-return]  # checked returns its argument


def format_text(budget: Budget, pattern: str, args: Sequence[Value], named: dict[str, Value]) -> str:
    """`pattern.format(*args, **named)`."""
    import string  # rarely needed: start-up time

    size = 0

    class Formatter(string.Formatter):
        def get_field(self, field_name: str, args: Value, kwargs: Value) -> Value:
            budget.charge(_FIELD_STEPS + len(field_name))
            first, _, _ = field_name.partition(".")
            first = first.partition("[")[0]
            value = self.get_value(int(first) if first.isdigit() else first, args, kwargs)
            for is_attribute, name in _field_path(field_name[len(first) :]):
                if is_attribute:
                    value = attribute(value, name)
                else:
                    value = value[int(name) if name.isdigit() else name]
                budget.measure(value)
            return value, first

        def convert_field(self, value: Value, conversion: Value) -> Value:
            if conversion:
                budget.weigh(value)
            return super().convert_field(value, conversion)

        def format_field(self, value: Value, format_spec: str) -> str:
            nonlocal size
            text = format_value(budget, value, format_spec)
            size += len(text)
            budget.length(size)
            return text

    budget.measure(pattern)
    budget.charge(pattern.count("{") + pattern.count("}"))  # the formatter handles them one by one
    return Formatter().vformat(pattern, args, named)


def _field_path(path: str) -> list[tuple[bool, str]]:
    parts = re.findall(r"\.([^.\[]+)|\[([^\]]+)(?:\]|\Z)", path)
    return [(bool(name), name or index) for name, index in parts]
