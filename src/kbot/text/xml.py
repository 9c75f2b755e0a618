"""XML with exact positions, by the standard library's expat.

Names are kept as written (`xacro:macro`), attributes in their order, comments and text as nodes.
An element made by xacro expansion is of the same type: it keeps the span of the element it was
written as, and the chain of calls that brought it.
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from xml.parsers import expat

from kbot.text.diagnostic import Diagnostic, Severity
from kbot.text.errors import DescriptionError
from kbot.text.span import Call, Origin, Source, Span

_ATTRIBUTE = re.compile(rb"""([^\s=/>"']+)\s*=\s*("[^"]*"|'[^']*')""")


class Text:
    """Character data between tags."""

    __slots__ = ("call", "end", "source", "start", "value")

    def __init__(self, value: str, source: Source, start: int, end: int, call: Call | None = None) -> None:
        self.value, self.source, self.start, self.end, self.call = value, source, start, end, call

    @property
    def origin(self) -> Origin:
        return Origin(Span(self.source, self.start, self.end), self.call)


class Comment(Text):
    """A comment; `value` is what stands between its marks."""

    __slots__ = ()


class Element:
    """An element: its name as written, attributes in order, children, and where it came from."""

    __slots__ = ("attributes", "call", "children", "end", "moved", "source", "start", "tag")

    def __init__(
        self,
        tag: str,
        attributes: dict[str, str],
        source: Source,
        start: int,
        end: int = -1,
        call: Call | None = None,
    ) -> None:
        self.tag = tag
        self.attributes = attributes
        self.children: list[Element | Text] = []
        self.source, self.start, self.end = source, start, end
        self.call = call
        self.moved: dict[str, Origin] | None = None
        """Origins of the attributes that were not written in this element's own tag."""

    def __repr__(self) -> str:
        return f"<{self.tag} {self.attributes}>"

    def elements(self, tag: str | None = None) -> Iterator[Element]:
        """Child elements in order, all or those of one name."""
        for child in self.children:
            if isinstance(child, Element) and (tag is None or child.tag == tag):
                yield child

    def find(self, tag: str) -> Element | None:
        """The first child element of a name."""
        return next(self.elements(tag), None)

    def descendants(self) -> Iterator[Element]:
        """Every element beneath this one, in document order."""
        for child in self.elements():
            yield child
            yield from child.descendants()

    @property
    def text(self) -> str:
        """The character data directly within, comments left out."""
        return "".join(c.value for c in self.children if isinstance(c, Text) and not isinstance(c, Comment))

    @property
    def origin(self) -> Origin:
        """The start tag's span and the calls that brought the element."""
        return Origin(Span(self.source, self.start, self._tag_end()), self.call)

    @property
    def whole(self) -> Span:
        """The span from the start tag to the end of the end tag, as it was written."""
        return Span(self.source, self.start, self.end)

    def attribute_origin(self, name: str) -> Origin:
        """The span of an attribute's value (without quotes); the element's own when it has none."""
        if self.moved and name in self.moved:
            return self.moved[name]
        span = self.attribute_spans().get(name)
        return Origin(span[1], self.call) if span else self.origin

    def attribute_spans(self) -> dict[str, tuple[Span, Span]]:
        """Name span and value span (without quotes) of every attribute written in the start tag."""
        spans = {}
        for match in _ATTRIBUTE.finditer(self.source.data, self.start, self._tag_end()):
            name = match[1].decode("utf-8", "replace")
            spans[name] = (
                Span(self.source, match.start(1), match.end(1)),
                Span(self.source, match.start(2) + 1, match.end(2) - 1),
            )
        return spans

    def _tag_end(self) -> int:
        data, at, quote = self.source.data, self.start, 0
        while at < len(data):
            byte = data[at]
            if quote:
                quote = 0 if byte == quote else quote
            elif byte in b"\"'":
                quote = byte
            elif byte == 0x3E:
                return at + 1
            at += 1
        return len(data)


def parse_xml(source: Source) -> Element:
    """Parse a source and return its root element.

    Raises:
        DescriptionError: P001 not well-formed, P002 empty, P003 a document type with entities.
    """
    return _Builder(source).parse()


class _Builder:
    def __init__(self, source: Source) -> None:
        self.source = source
        self.root: Element | None = None
        self.open: list[Element] = []
        parser = self.parser = expat.ParserCreate("UTF-8")
        parser.buffer_text = True
        parser.ordered_attributes = True
        parser.StartElementHandler = self._start
        parser.EndElementHandler = self._end
        parser.CharacterDataHandler = self._text
        parser.CommentHandler = self._comment
        parser.EntityDeclHandler = self._entity

    def parse(self) -> Element:
        if not self.source.text.strip():
            raise self._error("P002", "the file is empty", 0, "a robot starts with <robot name='…'>")
        try:
            self.parser.Parse(self.source.data, True)
        except expat.ExpatError as error:
            message = f"not well-formed XML: {expat.ErrorString(error.code)}"
            raise self._error("P001", message, self.parser.ErrorByteIndex) from None
        if self.root is None:
            raise self._error("P001", "not well-formed XML: no element found", 0)
        return self.root

    def _error(self, code: str, message: str, offset: int, hint: str = "") -> DescriptionError:
        origin = Origin(Span(self.source, offset, offset + 1))
        return DescriptionError([Diagnostic(code, Severity.ERROR, message, origin, hint)])

    def _start(self, tag: str, flat: list[str]) -> None:
        attributes = dict(zip(flat[::2], flat[1::2], strict=True))
        element = Element(tag, attributes, self.source, self.parser.CurrentByteIndex)
        if self.open:
            self.open[-1].children.append(element)
        else:
            self.root = element
        self.open.append(element)

    def _end(self, tag: str) -> None:
        element = self.open.pop()
        data, at = self.source.data, self.parser.CurrentByteIndex
        element.end = at if at <= element.start else data.index(b">", at) + 1
        if at == element.start:
            element.end = element._tag_end()

    def _text(self, value: str) -> None:
        if self.open:
            at = self.parser.CurrentByteIndex
            self.open[-1].children.append(Text(value, self.source, at, at))

    def _comment(self, value: str) -> None:
        if self.open:
            at = self.parser.CurrentByteIndex
            end = at + len(value.encode("utf-8", "surrogatepass")) + 7
            self.open[-1].children.append(Comment(value, self.source, at, end))

    def _entity(self, name: str, *_: object) -> None:
        raise self._error(
            "P003",
            f"the entity '{name}' is declared: entity declarations are refused",
            self.parser.CurrentByteIndex,
            "write the text itself, or use a xacro property",
        )
