"""The nodes of an XML tree, each with its place in the source.

Names are kept as written (`xacro:macro`), attributes in their order, comments and text as nodes.
An element made by xacro expansion is of the same type: it keeps the span of the element it was
written as, and the chain of calls that brought it.
"""

from __future__ import annotations

import re
from functools import lru_cache

from kbot.text.span import Call, Origin, Source, Span

TYPE_CHECKING = False
if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping
    from typing import Any

    from kbot.text.diagnostic import Diagnostic

_ATTRIBUTE = re.compile(rb"""\s([^\s=/>"']+)\s*=\s*("[^"]*"|'[^']*')""")
_TAG = re.compile(rb"""<[^<>"']*(?:"[^"]*"[^<>"']*|'[^']*'[^<>"']*)*>""")


class Text:
    """Character data between tags. `end` is where the markup after it begins."""

    __slots__ = ("_after", "call", "end", "source", "value")

    def __init__(self, value: str, source: Source, after: int, end: int, call: Call | None = None) -> None:
        self.value, self.source, self._after, self.end, self.call = value, source, after, end, call

    @property
    def start(self) -> int:
        """Where the text begins: behind the markup that stands before it."""
        return markup_end(self.source.data, self._after)

    @property
    def origin(self) -> Origin:
        return Origin(Span(self.source, self.start, self.end), self.call)

    def brought_by(self, call: Call | None, value: str | None = None) -> Text:
        """The same text, brought by a call; with another value where it was evaluated."""
        return type(self)(self.value if value is None else value, self.source, self._after, self.end, call)


class CData(Text):
    """A CDATA section; xacro leaves it as it is."""

    __slots__ = ()

    @property
    def start(self) -> int:
        return self._after


class Comment(CData):
    """A comment; `value` is what stands between its marks."""

    __slots__ = ()


class Instruction(CData):
    """A processing instruction or document type; `value` is what stands between its marks."""

    __slots__ = ()


class Element:
    """An element: its name as written, attributes in order, children, and where it came from."""

    __slots__ = (
        "_close",
        "attributes",
        "call",
        "children",
        "inputs",
        "is_plain",
        "moved",
        "source",
        "start",
        "tag",
    )

    def __init__(
        self,
        tag: str,
        attributes: dict[str, str],
        source: Source,
        start: int,
        close: int = -1,
        call: Call | None = None,
    ) -> None:
        self.tag = tag
        self.attributes = attributes
        self.children: list[Element | Text] = []
        self.source = source
        self.start = start
        self._close = close
        self.call = call
        self.is_plain = False
        """Whether neither it nor anything within it holds a dollar sign or a name of xacro's."""
        self.moved: dict[str, Origin] | None = None
        """Origins of the attributes that were not written in this element's own tag."""
        self.inputs: dict[str, Any] | None = None  # Any: bindings of xacro, which this package cannot import
        """The bindings that each attribute was computed from, by attribute name, for the source map."""

    def __repr__(self) -> str:
        return f"<{self.tag} {self.attributes}>"

    def made_by(self, call: Call | None, tag: str, attributes: dict[str, str]) -> Element:
        """A childless element written where this one is, brought by a call."""
        return Element(tag, attributes, self.source, self.start, self._close, call)

    def elements(self, tag: str | None = None) -> Iterator[Element]:
        """Child elements in order, all or those of one name."""
        if tag is None:
            return iter([c for c in self.children if type(c) is Element])
        return iter([c for c in self.children if type(c) is Element and c.tag == tag])

    def find(self, tag: str) -> Element | None:
        """The first child element of a name."""
        for child in self.children:
            if type(child) is Element and child.tag == tag:
                return child
        return None

    def descendants(self) -> Iterator[Element]:
        """Every element beneath this one, in document order."""
        pending = list(self.elements())[::-1]
        while pending:
            element = pending.pop()
            yield element
            pending.extend(list(element.elements())[::-1])

    @property
    def text(self) -> str:
        """The character data directly within, comments and instructions left out."""
        return "".join(
            c.value for c in self.children if isinstance(c, Text) and not isinstance(c, Comment | Instruction)
        )

    @property
    def end(self) -> int:
        """Offset behind the end tag, or behind the tag itself where it is empty."""
        data, tag_end = self.source.data, self.tag_end
        return tag_end if self._close < 0 or data[tag_end - 2] == 0x2F else markup_end(data, self._close)

    @property
    def tag_end(self) -> int:
        """Offset behind the start tag."""
        return _tag_end(self.source, self.start)

    @property
    def origin(self) -> Origin:
        """The start tag's span and the calls that brought the element."""
        return _LateOrigin(self, None)

    @property
    def whole(self) -> Span:
        """The span from the start tag to the end of the end tag, as it was written."""
        return Span(self.source, self.start, self.end)

    def attribute_origin(self, name: str) -> Origin:
        """The span of an attribute's value (without quotes); the element's own when it has none."""
        if self.moved and name in self.moved:
            return self.moved[name]
        return _LateOrigin(self, name)

    def attribute_spans(self) -> Mapping[str, tuple[Span, Span]]:
        """Name span and value span (without quotes) of every attribute written in the start tag."""
        return _attribute_spans(self.source, self.start)


class _LateOrigin(Origin):
    """The origin of an element or of its attribute's value, looked for in the text when it is asked for.

    A robot has one for each of its parts, and few are ever asked.
    """

    __slots__ = ("_attribute", "_element")

    def __init__(self, element: Element, attribute: str | None) -> None:
        self._element = element
        self._attribute = attribute
        self.call = element.call

    def __getattr__(self, name: str) -> Span:
        """`span`, while it is not known."""
        if name != "span":
            raise AttributeError(name)
        element, attribute = self._element, self._attribute
        spans = element.attribute_spans().get(attribute) if attribute is not None else None
        self.span = spans[1] if spans else Span(element.source, element.start, element.tag_end)
        return self.span


class XmlDocument:
    """A parsed file: what stands before the root, the root, what stands after it.

    `diagnostics` holds what is wrong but leaves a tree to work with. `nodes` counts elements and
    comments, `depth` the levels of elements.
    """

    __slots__ = ("after", "before", "depth", "diagnostics", "nodes", "root", "source")

    def __init__(self, source: Source) -> None:
        self.source = source
        self.root: Element
        self.before: list[Text] = []
        self.after: list[Text] = []
        self.diagnostics: tuple[Diagnostic, ...] = ()
        self.nodes = self.depth = 0


@lru_cache(maxsize=8)  # each of a tag's attributes asks for it in turn, and there may be thousands
def _tag_end(source: Source, start: int) -> int:
    match = _TAG.match(source.data, start)
    return match.end() if match else start


@lru_cache(maxsize=8)  # as above
def _attribute_spans(source: Source, start: int) -> Mapping[str, tuple[Span, Span]]:
    spans = {}
    for match in _ATTRIBUTE.finditer(source.data, start, _tag_end(source, start)):
        name = match[1].decode("utf-8", "replace")
        spans[name] = (
            Span(source, match.start(1), match.end(1)),
            Span(source, match.start(2) + 1, match.end(2) - 1),
        )
    return spans


def markup_end(data: bytes, at: int) -> int:
    """Offset behind the markup that begins at `at`; `at` itself where none does."""
    for opening, closing in ((b"<!--", b"-->"), (b"<![CDATA[", b"]]>"), (b"]]>", b"]]>"), (b"<?", b"?>")):
        if data.startswith(opening, at):
            end = data.find(closing, at)
            return end + len(closing) if end >= 0 else len(data)
    match = _TAG.match(data, at)
    return match.end() if match else at
