"""Turns bytes into choices. The fuzzer searches for bytes whose choices reach new code."""

from collections.abc import Sequence
from typing import TypeVar

Item = TypeVar("Item")


class Choices:
    """Numbers are taken from the end and texts from the start, so that a changed number does not move the
    texts. When the bytes are used up, numbers are the lowest and texts are empty."""

    def __init__(self, data: bytes) -> None:
        self._data = data
        self._start, self._end = 0, len(data)

    def integer(self, low: int, high: int) -> int:
        size = ((high - low).bit_length() + 7) // 8
        first = max(self._start, self._end - size)
        found = int.from_bytes(self._data[first : self._end], "little")
        self._end = first
        return low + found % (high - low + 1)

    def flag(self) -> bool:
        return bool(self.integer(0, 1))

    def pick(self, items: Sequence[Item]) -> Item:
        return items[self.integer(0, len(items) - 1)]

    def raw(self, most: int) -> bytes:
        first = self._start
        self._start = min(first + most, self._end)
        return self._data[first : self._start]

    def text(self, most: int) -> str:
        return self.raw(most).decode("utf-8", "replace")
