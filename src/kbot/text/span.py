"""Positions in source texts: sources, spans, and the macro calls and includes that led there."""

from __future__ import annotations

from bisect import bisect_right
from functools import cached_property, lru_cache
from itertools import accumulate

from kbot.brief import Brief

TYPE_CHECKING = False
if TYPE_CHECKING:
    from collections.abc import Iterator
    from typing import Literal


class Source(Brief):
    """A text and its path.

    Offsets are in bytes of the UTF-8 encoding, as the XML parser counts them. Lines and columns are 1-based,
    and columns count characters.
    """

    def __init__(self, path: str, text: str) -> None:
        self.path = path
        self.text = text

    def __repr__(self) -> str:
        return f"Source({self.path!r})"

    @cached_property
    def data(self) -> bytes:
        """The text as UTF-8. Offsets refer to it."""
        return self.text.encode("utf-8", "surrogatepass")

    @cached_property
    def _line_starts(self) -> list[int]:
        starts, at = [0], self.data.find(b"\n")
        while at >= 0:
            starts.append(at + 1)
            at = self.data.find(b"\n", at + 1)
        return starts

    @cached_property
    def line_end(self) -> str:
        """The line separator of the text."""
        return "\r\n" if "\r\n" in self.text else "\n"

    @property
    def line_count(self) -> int:
        return len(self._line_starts)

    def line(self, number: int) -> str:
        """Line `number` (1-based) without its line end. Empty if there is no such line."""
        return _line(self, number)

    def line_column(self, offset: int) -> tuple[int, int]:
        """Line and column (both 1-based) of a byte offset, which is clamped to the text."""
        offset = min(max(offset, 0), len(self.data))
        line = bisect_right(self._line_starts, offset)
        start = self._line_starts[line - 1]
        return line, self._characters(offset) - self._characters(start) + 1

    def _characters(self, offset: int) -> int:
        """The number of characters that begin before a byte offset."""
        if len(self.data) == len(self.text):
            return offset  # all of it is ASCII
        block = offset // _BLOCK
        return self._characters_before[block] + _count(self.data[block * _BLOCK : offset])

    @cached_property
    def _characters_before(self) -> list[int]:
        """For each block of bytes, the characters that begin before it: a line may be as long as the file."""
        counts = (_count(self.data[at : at + _BLOCK]) for at in range(0, len(self.data), _BLOCK))
        return [0, *accumulate(counts)]

    def offset(self, line: int, column: int) -> int:
        """Byte offset of a line and column (both 1-based)."""
        start = self._line_starts[min(max(line, 1), self.line_count) - 1]
        return start + len(self.line(line)[: max(column, 1) - 1].encode("utf-8", "surrogatepass"))

    def whole(self) -> Span:
        return Span(self, 0, len(self.data))


_BLOCK = 1024
_CONTINUED = bytes(range(0x80, 0xC0))
"""UTF-8 continuation bytes, which do not begin a character."""


def _count(data: bytes) -> int:
    return len(data.translate(None, _CONTINUED))


@lru_cache(maxsize=8)  # many findings may be in one long line
def _line(source: Source, number: int) -> str:
    starts, data = source._line_starts, source.data
    if not 1 <= number <= len(starts):
        return ""
    end = starts[number] if number < len(starts) else len(data)
    return data[starts[number - 1] : end].decode("utf-8", "replace").rstrip("\r\n")


class Span(Brief):
    """A part of a source: the byte offsets from `start` to `end`, exclusive. Do not change an instance.

    This class and the next two are not dataclasses. Every macro call creates some, and importing dataclasses
    would double the time of `kbot expand`.
    """

    __slots__ = ("end", "source", "start")

    def __init__(self, source: Source, start: int, end: int) -> None:
        self.source = source
        self.start = start
        self.end = end

    def __eq__(self, other: object) -> bool:
        if not isinstance(other, Span):
            return NotImplemented
        return (self.source, self.start, self.end) == (other.source, other.start, other.end)

    def __hash__(self) -> int:
        return hash((self.source, self.start, self.end))

    def __repr__(self) -> str:
        return f"Span({self})"

    @property
    def file(self) -> str:
        return self.source.path

    @property
    def line(self) -> int:
        return self.source.line_column(self.start)[0]

    @property
    def column(self) -> int:
        return self.source.line_column(self.start)[1]

    @property
    def text(self) -> str:
        return self.source.data[self.start : self.end].decode("utf-8", "replace")

    def __str__(self) -> str:
        line, column = self.source.line_column(self.start)
        return f"{self.file}:{line}:{column}"


class Call:
    """A macro call or include that led to an element, and where it was written. Do not change an instance.

    Calls are a linked list, so that the thousands of elements that a macro creates share one chain.
    """

    __slots__ = ("caller", "kind", "name", "span")

    def __init__(
        self, kind: Literal["macro", "include"], name: str, span: Span, caller: Call | None = None
    ) -> None:
        self.kind: Literal["macro", "include"] = kind
        self.name = name
        self.span = span
        self.caller = caller

    def __eq__(self, other: object) -> bool:
        if not isinstance(other, Call):
            return NotImplemented
        return self is other or (self.kind, self.name, self.span, self.caller) == (
            other.kind,
            other.name,
            other.span,
            other.caller,
        )

    def __hash__(self) -> int:
        return hash((self.kind, self.name, self.span))

    def __repr__(self) -> str:
        return f"Call({self.kind} {self.name} at {self.span})"

    def chain(self) -> Iterator[Call]:
        """This call and its callers, innermost first."""
        call: Call | None = self
        while call is not None:
            yield call
            call = call.caller


class Origin(Brief):
    """The span where something was written, and the call that led there. Do not change an instance."""

    __slots__ = ("call", "span")

    def __init__(self, span: Span, call: Call | None = None) -> None:
        self.span = span
        self.call = call

    def __eq__(self, other: object) -> bool:
        if not isinstance(other, Origin):
            return NotImplemented
        return self.span == other.span and self.call == other.call

    def __hash__(self) -> int:
        return hash((self.span, self.call))

    def __repr__(self) -> str:
        return f"Origin({self.span})"

    @property
    def stack(self) -> tuple[Call, ...]:
        """Macro calls and includes, innermost first."""
        return tuple(self.call.chain()) if self.call else ()

    def __str__(self) -> str:
        return str(self.span)
