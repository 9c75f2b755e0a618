"""The space of a sweep: what varies, and its values."""

from __future__ import annotations

import math
import re
from collections.abc import Sequence
from dataclasses import dataclass
from enum import StrEnum
from typing import ClassVar

from kbot.text import KbotError
from kbot.text.numbers import to_float
from kbot.text.render import encodable

Value = int | float | str
Values = tuple[Value, ...]
"""One value for each dimension."""

MOST_LISTED = 10_000
"""Values of a list. A range can have more: its values are computed."""
LARGEST = 2**63 - 1
"""Integers of a table have 64 bits."""
_LONGEST = 20
"""Characters of the longest integer, with its sign."""
_DIGITS = 12
"""Significant digits of a value between the ends of a range: 0.025 instead of 0.025000000000000001."""
_RESOLUTION = 6
"""Decimal digits to which a random value divides its range. The values stay readable in a description."""
_INTEGER = re.compile(r"[+-]?\d+", re.ASCII)


class Target(StrEnum):
    """What the values of a dimension set."""

    ARGUMENT = "argument"
    PROPERTY = "property"
    WORLD = "world"
    WORLD_PARAMETER = "world parameter"
    SEED = "seed"
    SCENARIO = "scenario key"


@dataclass(frozen=True, slots=True)
class Choices:
    """A list of values: all integers, all numbers, or all texts."""

    values: Values

    @property
    def count(self) -> int:
        return len(self.values)

    @property
    def is_ordered(self) -> bool:
        """Whether neighbours in the list are similar."""
        return not isinstance(self.values[0], str) and list(self.values) == sorted(self.values)

    def nth(self, index: int) -> Value:
        return self.values[index]

    def samples(self) -> list[Value]:
        """All values, to check them."""
        return list(self.values)

    def at(self, fraction: float) -> Value:
        """The value at a fraction from 0 to below 1: each value has an equal share."""
        return self.nth(int(fraction * self.count))


@dataclass(frozen=True, slots=True)
class Levels:
    """Equally spaced values from `low` to `high`, both included. They are integers if all of them can be."""

    low: float
    high: float
    count: int
    is_ordered: ClassVar[bool] = True

    def nth(self, index: int) -> Value:
        if index in (0, self.count - 1):
            return self.high if index else self.low
        span, steps = self.high - self.low, self.count - 1
        if isinstance(self.low, int) and isinstance(self.high, int) and span % steps == 0:
            return self.low + int(span) // steps * index
        return float(f"{self.low + span * index / steps:.{_DIGITS}g}")

    def samples(self) -> list[Value]:
        """A few values, to check them: the ends, and some between them."""
        return [self.nth(index) for index in sorted({0, self.count // 2, self.count - 1})]

    def at(self, fraction: float) -> Value:
        """The value at a fraction from 0 to below 1: each value has an equal share."""
        return self.nth(int(fraction * self.count))


@dataclass(frozen=True, slots=True)
class Interval:
    """All real numbers from `low` to `high`. It cannot be a dimension of a grid."""

    low: float
    high: float
    count: ClassVar[None] = None

    def samples(self) -> list[Value]:
        """A few values, to check them: the ends, and one between them."""
        return [self.low, self.at(0.5), self.high]

    def at(self, fraction: float) -> float:
        """The value at a fraction from 0 to below 1."""
        return self.nearest(self.low + (self.high - self.low) * fraction)

    def nearest(self, value: float) -> float:
        """A value, rounded to a millionth of the range."""
        value = round(value, _RESOLUTION - math.floor(math.log10(self.high - self.low)))
        return min(max(value, self.low), self.high)


@dataclass(frozen=True, slots=True)
class Dimension:
    """Something that varies.

    name    as the user typed it: the name of the column in the table
    text    the values as the user typed them
    domain  the values
    target  what they set. An argument becomes a property when the robot is read
    unit    of its values, as the robot or the scenario has it. Empty if it is not known, or there is none
    """

    name: str
    text: str
    domain: Choices | Levels | Interval
    target: Target = Target.ARGUMENT
    unit: str = ""

    @property
    def count(self) -> int | None:
        """How many values it has. None for all numbers of an interval."""
        return self.domain.count

    @property
    def kind(self) -> type[int] | type[float] | type[str]:
        """The type of its values: `int` if all of them are integers."""
        if isinstance(self.domain, Interval):
            return float
        if isinstance(self.domain, Choices):
            return type(self.domain.values[0])
        ends = (self.domain.low, self.domain.nth(1) if self.domain.count > 1 else self.domain.low)
        return int if all(isinstance(each, int) for each in ends) else float

    def has(self, value: Value) -> bool:
        """Whether a value can be one of its values: it is in their list, or has their type."""
        if isinstance(self.domain, Choices):
            return value in self.domain.values
        if isinstance(value, int):
            return abs(value) <= LARGEST
        return self.kind is float and isinstance(value, float)

    @property
    def is_integer_range(self) -> bool:
        """Whether it was typed as `low:high` with integers, which may be meant as all numbers between."""
        return self.kind is int and self.text.count(":") == 1

    def __str__(self) -> str:
        return f"{self.name}={self.text}"


@dataclass(frozen=True, slots=True)
class Space:
    """The dimensions of a sweep. The last one varies fastest in a grid."""

    dimensions: tuple[Dimension, ...]

    @property
    def size(self) -> int | None:
        """The number of combinations of all values. None if it is not finite."""
        counts = [each.count for each in self.dimensions]
        return None if None in counts else math.prod(count for count in counts if count is not None)

    def grid(self, index: int) -> Values:
        """A combination of a grid. Raises TypeError: a dimension is an interval."""
        found: list[Value] = []
        for each in reversed(self.dimensions):
            if isinstance(each.domain, Interval):
                raise TypeError(f"{each.name} is an interval")
            index, place = divmod(index, each.domain.count)
            found.append(each.domain.nth(place))
        return tuple(reversed(found))

    def at(self, fractions: Sequence[float]) -> Values:
        """The values at fractions from 0 to below 1, one for each dimension."""
        return tuple(
            each.domain.at(float(fraction)) for each, fraction in zip(self.dimensions, fractions, strict=True)
        )


def parse_dimension(text: str) -> Dimension:
    """The dimension of `NAME=low:high:count`, `NAME=low:high` or `NAME=a,b,c`.

    Raises:
        KbotError: the text has another form, or the range is empty or endless.
    """
    name, equals, values = (part.strip() for part in text.partition("="))
    name = name.removesuffix(":")  # name:=value is how other verbs take arguments
    if encodable(text) != text:
        raise KbotError(f"--set {encodable(text)} is not valid UTF-8. Rename the file")
    if not equals or not name:
        raise KbotError(f"'{text}' is not NAME=VALUES, for example wheel_radius=0.02:0.05:7")
    target = _target(name)
    try:
        domain = _domain(values, is_world=target is Target.WORLD)
        if target is Target.SEED:
            _require_seeds(domain)
    except ValueError as error:
        raise KbotError(f"--set {name}={values}: {error}") from None
    return Dimension(name, values, domain, target)


def parse_space(texts: Sequence[str]) -> Space:
    """The space of several dimensions. Raises KbotError: as `parse_dimension`, or a name is given twice."""
    dimensions = tuple(map(parse_dimension, texts))
    names = [each.name for each in dimensions]
    for name in names:
        if names.count(name) > 1:
            raise KbotError(f"--set {name} is given twice. Give all values in one list: {name}=a,b,c")
    return Space(dimensions)


def _target(name: str) -> Target:
    if name in ("world", "seed"):
        return Target(name)
    if name.startswith("world."):
        return Target.WORLD_PARAMETER
    return Target.SCENARIO if name.startswith("scenario.") else Target.ARGUMENT


def _domain(text: str, *, is_world: bool) -> Choices | Levels | Interval:
    if not text:
        raise ValueError("there are no values")
    if is_world:
        return _choices(_worlds(text))
    if "," in text:
        return _choices(text.split(","))
    parts = text.split(":")
    if len(parts) == 1 or (any(parts) and not any(map(_is_number, parts))):
        return _choices([text])
    if len(parts) > 3:
        raise ValueError("a range is low:high or low:high:count")
    return _range(*parts)


def _worlds(text: str) -> list[str]:
    """The worlds of a list. `stairs:steps=2,height=0.01` is one: no name of a world contains `=`."""
    worlds: list[str] = []
    for part in text.split(","):
        if worlds and "=" in part.partition(":")[0]:
            worlds[-1] += f",{part}"
        else:
            worlds.append(part)
    return worlds


def _range(low: str, high: str, count: str = "") -> Levels | Interval:
    first, last = _number(low, "the lower end"), _number(high, "the upper end")
    if first > last:
        raise ValueError(f"the range is empty: {low} is above {high}")
    if not count:
        if isinstance(first, int) and isinstance(last, int):
            return Levels(first, last, last - first + 1)
        if first == last:
            raise ValueError(f"the range has only one value. Write {low}")
        if not math.isfinite(last - first):
            raise ValueError("the range is too wide")
        return Interval(float(first), float(last))
    if not _INTEGER.fullmatch(count) or len(count) > _LONGEST or int(count) < 1:
        raise ValueError(f"the number of values must be an integer from 1 on, not '{count}'")
    if (int(count) == 1) != (first == last):
        few = f"1 value cannot include both {low} and {high}"
        raise ValueError(f"all {count} values are equal" if first == last else few)
    if not math.isfinite(last - first):
        raise ValueError("the range is too wide")
    if isinstance(first, int) and isinstance(last, int):
        return Levels(first, last, int(count))
    return Levels(float(first), float(last), int(count))


def _choices(texts: Sequence[str]) -> Choices:
    words = [text.strip() for text in texts]
    if "" in words:
        raise ValueError("one of the values is empty")
    if len(words) > MOST_LISTED:
        raise ValueError(f"a list has at most {MOST_LISTED} values. For numbers, write low:high:count")
    for word in words:
        if len(words) > 1 and ":" in word and all(map(_is_number, word.split(":"))):
            raise ValueError(f"a list cannot contain a range, and '{word}' is one")
    values: list[Value] = list(words)
    if all(map(_is_number, words)):
        numbers = [_number(word, f"'{word}'") for word in words]
        is_integer = all(isinstance(number, int) for number in numbers)
        values = list(numbers) if is_integer else [float(number) for number in numbers]
    if len(set(values)) < len(values):
        twice = next(value for index, value in enumerate(values) if value in values[:index])
        raise ValueError(f"the value {twice} is given twice")
    return Choices(tuple(values))


def _require_seeds(domain: Choices | Levels | Interval) -> None:
    values: list[Value] = [0.5] if isinstance(domain, Interval) else domain.samples()
    if not all(isinstance(value, int) and value >= 0 for value in values):
        raise ValueError("seeds are integers from 0 on")


def _is_number(text: str) -> bool:
    try:
        to_float(text.strip())
    except ValueError:
        return False
    return True


def _number(text: str, what: str) -> int | float:
    """The number in a text: an integer if it is written as one."""
    text = text.strip()
    if _INTEGER.fullmatch(text):
        if len(text) > _LONGEST or abs(int(text)) > LARGEST:
            raise ValueError(f"{what} is too large: integers have at most 64 bits")
        return int(text)
    try:
        number = to_float(text)
    except ValueError:
        raise ValueError(f"{what} must be a number, not '{text}'") from None
    if not math.isfinite(number):
        raise ValueError(f"{what} must be finite, not '{text}'")
    return number
