"""What one expansion may still spend, and how large a value of an expression may be."""

from __future__ import annotations

import re

from kbot.xacro.faults import LimitFault

TYPE_CHECKING = False
if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

    from kbot.xacro.limits import Limits
    from kbot.xacro.values import Value

SIZED = (list, tuple, dict, set, frozenset, range)
"""What has a length to be counted, item by item; texts cost less."""
_RAISE_HINT = "raise the bound with Limits({name}=…) if the description is to be trusted"
_WIDTH = re.compile(r"\d{4,}|\*")


class Budget:
    """What is left of the steps of one expansion, and how large a value may be."""

    def __init__(self, limits: Limits) -> None:
        self.limits = limits
        self.steps = limits.steps
        self.function_depth = limits.function_depth

    def exceeded(self, name: str, what: str) -> LimitFault:
        bound = getattr(self.limits, name)
        return LimitFault("X190", f"{what} (the bound is {bound:,})", _RAISE_HINT.format(name=name))

    def charge(self, steps: int) -> None:
        """Take steps from what is left."""
        self.steps -= steps
        if self.steps < 0:
            raise self.exceeded("steps", "the expressions take too many steps")

    def length(self, count: int) -> None:
        """Refuse a text or list of so many items."""
        if count > self.limits.length:
            raise self.exceeded("length", f"an expression makes a text or list of {count:,} items")

    def bits(self, count: float) -> None:
        """Refuse a whole number of so many bits."""
        if count > self.limits.bits:
            raise self.exceeded("bits", "an expression makes too large a whole number")

    def checked(self, value: Value) -> Value:
        """The value, where it is not too large."""
        kind = type(value)
        if kind is float or kind is bool or value is None:
            return value
        if kind is int:
            if value.bit_length() > self.limits.bits:
                self.bits(value.bit_length())
        elif isinstance(value, str | bytes):
            size = len(value)
            if size > 64:
                self.length(size)
                self.charge(size >> 6)
        elif isinstance(value, SIZED):
            self.length(len(value))
            self.charge(len(value) >> 2)
        return value

    def weigh(self, value: Value) -> None:
        """Count everything within nested lists and dictionaries, shared parts as often as they show."""
        if not isinstance(value, SIZED) or isinstance(value, range):
            return
        left, path = self.steps, 0
        pending: list[Iterator[Value]] = [iter((value,))]
        while pending:
            item = next(pending[-1], pending)
            if item is pending:
                pending.pop()
                continue
            left -= 1
            if isinstance(item, str):
                left -= len(item) >> 6
            elif isinstance(item, dict):
                pending.append(iter([*item.keys(), *dict.values(item)]))
            elif isinstance(item, SIZED) and not isinstance(item, range):
                pending.append(list.__iter__(item) if isinstance(item, list) else iter(item))
            path = max(path, len(pending))
            if left < 0 or path > 200:
                raise self.exceeded("steps", "a nested list or dictionary is too large")
        self.steps = left

    def text(self, value: Value) -> str:
        """`str(value)`."""
        if type(value) is str:
            return value
        self.weigh(value)
        return str(value)

    def measure(self, value: Value) -> None:
        """Take the steps of going through a value once."""
        if isinstance(value, SIZED):
            self.charge(len(value))
        elif isinstance(value, str | bytes):
            self.charge(len(value) >> 4)

    def widths(self, pattern: str, values: Sequence[Value]) -> None:
        """Refuse a format that pads too far; `values` are those a `*` may mean."""
        for match in _WIDTH.findall(pattern):
            widths = [v for v in values if isinstance(v, int)] if match == "*" else [int(match)]
            self.length(max(map(abs, widths), default=0))
