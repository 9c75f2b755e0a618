"""Find the link that each piece of source text belongs to, through macros and includes."""

from __future__ import annotations

from bisect import bisect_right
from collections.abc import Iterator
from dataclasses import dataclass, field

from kbot.text import Call, Element, Origin, Span


@dataclass(slots=True)
class _Piece:
    """A span of a file, with its links. Several calls may have made links of it."""

    start: int
    end: int
    links: dict[str, None] = field(default_factory=dict)
    link_of_call: dict[int, str] = field(default_factory=dict)
    """The first link by the `id` of the call, as comparing calls is slow. `Ownership` keeps the calls."""

    @property
    def last(self) -> int:
        """The last byte. An empty span has the byte that follows it."""
        return max(self.end - 1, self.start)


class _File:
    """The pieces of a file. As those of elements do, they contain each other or are apart."""

    def __init__(self, pieces: list[_Piece]) -> None:
        self._pieces = sorted(pieces, key=lambda piece: (piece.start, -piece.last, -piece.end))
        self._starts = [piece.start for piece in self._pieces]
        self._outer: list[int | None] = []
        """The index of the smallest piece around each piece."""
        around: list[int] = []
        for index, piece in enumerate(self._pieces):
            while around and self._pieces[around[-1]].last < piece.last:
                around.pop()
            self._outer.append(around[-1] if around else None)
            around.append(index)

    def around(self, at: int) -> Iterator[_Piece]:
        """Yield the pieces around a byte, the smallest first."""
        before = bisect_right(self._starts, at) - 1
        index = before if before >= 0 else None
        while index is not None:
            piece = self._pieces[index]
            if at <= piece.last:
                yield piece
            index = self._outer[index]


class Ownership:
    """Spans of the links and joints of an expanded document. A joint belongs to its child link."""

    def __init__(self, document: Element | None) -> None:
        self._document = document
        self._pieces: dict[str, dict[tuple[int, int], _Piece]] = {}
        for element in document.elements() if document is not None else ():
            link = _link_of(element)
            for part in (element, *element.descendants()) if link else ():
                self._add(part.source.path, part.start, part.end, part.call, link)
                for call in part.origin.stack:
                    self._add(call.span.file, call.span.start, call.span.end, call.caller, link)
        self._files = {file: _File(list(pieces.values())) for file, pieces in self._pieces.items()}

    def link_at(self, origin: Origin | None) -> str:
        """Return the link of the smallest element around an origin, or an empty string."""
        if origin is None or origin.span.file not in self._files:
            return ""
        around = list(self._files[origin.span.file].around(origin.span.start))
        same_call = (link for piece in around if (link := piece.link_of_call.get(id(origin.call))))
        return next(same_call, next(iter(around[0].links)) if around else "")

    def lines(self, span: Span) -> tuple[tuple[str, ...], ...]:
        """Return the links of each line of a text. There are several where a macro made several."""
        owners: dict[int, tuple[int, dict[str, None]]] = {}
        for piece in self._pieces.get(span.file, {}).values():
            first = span.source.line_column(piece.start)[0]
            last = span.source.line_column(max(piece.start, piece.end - 1))[0]
            width = piece.end - piece.start
            for line in range(first, last + 1):
                if line not in owners or width < owners[line][0]:
                    owners[line] = (width, {})
                if width == owners[line][0]:
                    owners[line][1].update(piece.links)
        return tuple(tuple(owners.get(n, (0, {}))[1]) for n in range(1, span.source.line_count + 1))

    def _add(self, file: str, start: int, end: int, call: Call | None, link: str) -> None:
        pieces = self._pieces.setdefault(file, {})
        piece = pieces.get((start, end))
        if piece is None:
            piece = pieces[start, end] = _Piece(start, end)
        piece.links[link] = None
        piece.link_of_call.setdefault(id(call), link)


def _link_of(element: Element) -> str:
    if element.tag == "link":
        return element.attributes.get("name", "")
    if element.tag == "joint":
        child = element.find("child")
        return child.attributes.get("link", "") if child is not None else ""
    if element.tag == "gazebo":
        return element.attributes.get("reference", "")
    return ""
