"""Find the link that each piece of source text belongs to, through macros and includes."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterator
from dataclasses import dataclass

from kbot.text import Call, Element, Origin, Span


@dataclass(frozen=True, slots=True)
class _Piece:
    start: int
    end: int
    call: Call | None
    link: str


class Ownership:
    """Spans of the links and joints of an expanded document. A joint belongs to its child link."""

    def __init__(self, document: Element | None) -> None:
        self._pieces: dict[str, list[_Piece]] = defaultdict(list)
        for element in document.elements() if document is not None else ():
            link = _link_of(element)
            for part in (element, *element.descendants()) if link else ():
                self._pieces[part.source.path].append(_Piece(part.start, part.end, part.call, link))
                for call in part.origin.stack:
                    span = call.span
                    self._pieces[span.file].append(_Piece(span.start, span.end, call.caller, link))

    def link_at(self, origin: Origin | None) -> str:
        """Return the link of the smallest element around an origin, or an empty string."""
        if origin is None:
            return ""
        around = list(self._around(origin.span))
        same_call = [piece for piece in around if piece.call is origin.call]
        best = min(same_call or around, key=lambda piece: piece.end - piece.start, default=None)
        return best.link if best else ""

    def lines(self, span: Span) -> tuple[tuple[str, ...], ...]:
        """Return the links of each line of a text. There are several where a macro made several."""
        owners: dict[int, tuple[int, dict[str, None]]] = {}
        for piece in self._pieces.get(span.file, ()):
            first = span.source.line_column(piece.start)[0]
            last = span.source.line_column(max(piece.start, piece.end - 1))[0]
            width = piece.end - piece.start
            for line in range(first, last + 1):
                if line not in owners or width < owners[line][0]:
                    owners[line] = (width, {})
                if width == owners[line][0]:
                    owners[line][1][piece.link] = None
        return tuple(tuple(owners.get(n, (0, {}))[1]) for n in range(1, span.source.line_count + 1))

    def _around(self, span: Span) -> Iterator[_Piece]:
        for piece in self._pieces.get(span.file, ()):
            if piece.start <= span.start < max(piece.end, piece.start + 1):
                yield piece


def _link_of(element: Element) -> str:
    if element.tag == "link":
        return element.attributes.get("name", "")
    if element.tag == "joint":
        child = element.find("child")
        return child.attributes.get("link", "") if child is not None else ""
    if element.tag == "gazebo":
        return element.attributes.get("reference", "")
    return ""
