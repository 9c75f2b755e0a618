"""The budget of one expansion: how much work remains, and how large values may become.

All work is counted in steps. A step takes at most about a microsecond of CPU time and 64 bytes of memory, so
a limit on steps limits both. Work is charged before it is done.
"""

from __future__ import annotations

from kbot.xacro.values import YamlList
from kbot.xacro.xacro_error import LimitFault, XacroError

TYPE_CHECKING = False
if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator, Sequence
    from typing import Any

    from kbot.xacro.limits import Limits
    from kbot.xacro.values import Value

# Any: mypy would narrow values to object
VIEWS: tuple[Any, ...] = (type({}.keys()), type({}.values()), type({}.items()))
SIZED: tuple[Any, ...] = (list, tuple, dict, set, frozenset, range, *VIEWS)
"""Containers, which are charged by their items. Text is charged by its length instead."""
HASHED: tuple[Any, ...] = (dict, set, frozenset, VIEWS[0], VIEWS[2])
"""Containers that find their items by hash."""

_SHORT = 64
"""Characters of an existing text, and bits of an integer, that each operation may handle for free."""
_SHORT_MADE = 16
"""Characters of a new text that are free: at four bytes each, they take as much memory as its header."""
_DEEPEST = 200
"""Levels of nested containers. Python's C code recurses once per level, and does not check for tuples."""
_OWN_HASH = (1 << 61) - 1
"""A smaller integer is its own hash. Larger ones can be chosen so that they share one hash."""


class Budget:
    """The steps that remain of one expansion."""

    def __init__(self, limits: Limits) -> None:
        self.limits = limits
        self.steps = limits.steps
        self.function_depth = limits.function_depth

    def exceeded(self, name: str, what: str) -> LimitFault:
        bound = getattr(self.limits, name)
        hint = f"simplify it; for a trusted file, Python code can raise the limit with Limits({name}=…)"
        return LimitFault("X190", f"{what} (the limit is {bound:,})", hint)

    def charge(self, steps: int) -> None:
        """Use up steps."""
        self.steps -= steps
        if self.steps < 0:
            raise self.exceeded("steps", "the expressions take too many steps")

    def enter(self) -> None:
        """Enter a function or iterator that another one calls. `leave` is the opposite."""
        self.function_depth -= 1
        if self.function_depth < 0:
            raise self.exceeded("function_depth", "the recursion of functions or iterators is too deep")

    def leave(self) -> None:
        self.function_depth += 1

    # --- sizes -------------------------------------------------------------------------------

    def length(self, count: int) -> None:
        """Raise LimitFault for a text or container with too many items."""
        if count > self.limits.length:
            raise self.exceeded("length", "an expression creates a string or list that is too long")

    def bits(self, count: float) -> None:
        """Raise LimitFault for an integer with too many bits."""
        if count > self.limits.bits:
            raise self.exceeded("bits", "an expression creates an integer that is too large")

    def checked(self, value: Value) -> Value:
        """Return the value, after charging its memory. Raises LimitFault if it is too large."""
        kind = type(value)
        if kind is float or kind is bool or value is None:
            return value
        if kind is int:
            bits = value.bit_length()
            if bits > _SHORT:
                self.bits(bits)
                self.charge(bits >> 9)
        elif isinstance(value, str | bytes):
            size = len(value)
            if size > _SHORT_MADE:
                self.length(size)
                self.charge(size >> 4)
        elif isinstance(value, SIZED) and not isinstance(value, range):
            size = len(value)
            self.length(size)
            # an entry of a dictionary or set takes about 100 bytes, one of a list or tuple 8
            self.charge(size << 1 if isinstance(value, dict | set | frozenset) else size >> 2)
        return value

    def joined(self, parts: Sequence[str]) -> str:
        """The concatenated parts. Their length is checked before the text is made."""
        total = sum(map(len, parts))
        if total > _SHORT_MADE:
            self.length(total)
            self.charge(total >> 4)
        return "".join(parts)

    def spread(self, value: Value) -> None:
        """Charge splitting a text into a list: each character becomes a text of up to 80 bytes."""
        if isinstance(value, str):
            self.charge(len(value))

    # --- work --------------------------------------------------------------------------------

    def integer(self, value: int) -> None:
        """Charge a division or conversion of an integer, whose work grows with the square of the digits."""
        bits = value.bit_length()
        if bits > _SHORT:
            self.charge((bits >> 6) + ((bits >> 5) ** 2 >> 10))

    def measure(self, value: Value) -> None:
        """Charge going through a value once, without nested values."""
        kind = type(value)
        if kind is float or kind is bool or value is None:
            return
        if kind is int:
            self.integer(value)
        elif isinstance(value, str | bytes):
            if len(value) > _SHORT:
                self.charge(len(value) >> 4)
        elif kind is YamlList:  # each access copies an item
            self.weigh(value)
        elif isinstance(value, SIZED):
            self.charge(len(value))

    def weigh(self, value: Value) -> None:
        """Charge going through a value and all nested values. Shared parts count as often as they occur.

        Comparing, hashing, sorting and writing a value take this much work.
        """
        if not isinstance(value, SIZED) or isinstance(value, range):
            self.measure(value)
            return
        left = self.steps
        pending: list[Iterator[Value]] = [iter((value,))]
        while pending:
            for item in pending[-1]:
                left -= 1
                kind = type(item)
                if kind is float or kind is bool or item is None:
                    continue
                if isinstance(item, str | bytes):
                    left -= len(item) >> 2  # an unprintable character is written as ten
                elif isinstance(item, int):
                    bits = item.bit_length()
                    if bits > _SHORT:
                        left -= (bits >> 6) + ((bits >> 5) ** 2 >> 10)
                elif isinstance(item, dict):
                    left -= len(item)
                    pending.append(iter([*item.keys(), *dict.values(item)]))
                    break
                elif isinstance(item, SIZED) and not isinstance(item, range):
                    pending.append(list.__iter__(item) if isinstance(item, list) else iter(item))
                    break
            else:
                pending.pop()
            if left < 0 or len(pending) > _DEEPEST:
                raise self.exceeded("steps", "a nested list or dictionary is too large")
        self.steps = left

    def text(self, value: Value) -> str:
        """`str(value)`.

        Raises:
            XacroError: X104, the value contains an integer with more digits than Python writes.
        """
        kind = type(value)
        if kind is str:
            return value  # type: ignore[no-any-return]  # it is one
        if kind is float:
            return str(value)
        self.weigh(value)
        try:
            return str(value)
        except ValueError as error:
            raise XacroError("X104", f"the value cannot be converted to text: {error}") from None

    def keys(self, size: int, keys: Iterable[Value]) -> None:
        """Charge finding or inserting keys in a container that already has `size` keys.

        Numbers and tuples can be chosen so that all share one hash. Then each is compared with all previous
        ones, at about 20 ns each. Texts are safe, because Python randomizes their hashes in each process.
        Small integers are safe, because their hashes differ.
        """
        chosen = count = compared = 0
        for key in keys:
            count += 1
            kind = type(key)
            if kind is str or kind is bytes:
                compared += len(key) >> 6  # an equal key may be a different object
                continue
            if kind is bool or key is None:
                continue
            if kind is int or kind is float:
                # the container may already hold keys with this hash
                chosen += size
                if kind is int and not -_OWN_HASH < key < _OWN_HASH:
                    chosen += count
            else:
                self.weigh(key)
                chosen += size + count
        self.charge((count >> 2) + (chosen >> 5) + compared)
