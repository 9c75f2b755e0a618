"""The nodes of an XML tree, each with its position in the source.

Names are kept as written (`xacro:macro`), attributes keep their order, and comments and text are nodes.
Elements that xacro creates have the same type: they keep the span of the source element, and the calls that
led to it.
"""

from __future__ import annotations

import re
from functools import lru_cache

from kbot.brief import Brief
from kbot.text.span import Call, Origin, Source, Span

TYPE_CHECKING = False
if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping
    from typing import Any

    from kbot.text.diagnostic import Diagnostic

_ATTRIBUTE = re.compile(rb"""\s([^\s=/>"']+)\s*=\s*("[^"]*"|'[^']*')""")
_TAG = re.compile(rb"""<[^<>"']*(?:"[^"]*"[^<>"']*|'[^']*'[^<>"']*)*>""")


class Text(Brief):
    """Character data between tags. `end` is the start of the next markup."""

    __slots__ = ("_after", "call", "end", "inputs", "source", "value")

    def __init__(self, value: str, source: Source, after: int, end: int, call: Call | None = None) -> None:
        self.value, self.source, self._after, self.end, self.call = value, source, after, end, call
        self.inputs: tuple[Any, ...] = ()  # Any: bindings of xacro, which this package cannot import
        """The bindings that an evaluated text was computed from."""

    def __repr__(self) -> str:
        return f"{type(self).__name__}({self.value if len(self.value) <= 60 else f'{self.value[:59]}…'!r})"

    @property
    def start(self) -> int:
        """The start of the text, after the previous markup."""
        return markup_end(self.source.data, self._after)

    @property
    def origin(self) -> Origin:
        return Origin(Span(self.source, self.start, self.end), self.call)

    def with_call(self, call: Call | None, value: str | None = None) -> Text:
        """A copy of the text that a call led to, with its evaluated value if there is one."""
        return type(self)(self.value if value is None else value, self.source, self._after, self.end, call)


class CData(Text):
    """A CDATA section. xacro does not change it."""

    __slots__ = ()

    @property
    def start(self) -> int:
        return self._after


class Comment(CData):
    """A comment. `value` is the text between `<!--` and `-->`."""

    __slots__ = ()


class Instruction(CData):
    """A processing instruction or document type. `value` is the text between `<` and `>`."""

    __slots__ = ()


class Element(Brief):
    """An element: its name as written, attributes in order, children, and origin."""

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
        """Whether the element and its content have neither a dollar sign nor a xacro name."""
        self.moved: dict[str, Origin] | None = None
        """Origins of the attributes that were not written in this element's tag."""
        self.inputs: dict[str, Any] | None = None  # Any: bindings of xacro, which this package cannot import
        """The bindings that each attribute was computed from, by attribute name, for the source map."""

    def __repr__(self) -> str:
        return f"<{self.tag} {self.attributes}>"

    def childless_copy(self, call: Call | None, tag: str, attributes: dict[str, str]) -> Element:
        """An element without children at the same position, to which a call led."""
        return Element(tag, attributes, self.source, self.start, self._close, call)

    def elements(self, tag: str | None = None) -> Iterator[Element]:
        """The child elements in order: all, or those with one name."""
        if tag is None:
            return iter([c for c in self.children if type(c) is Element])
        return iter([c for c in self.children if type(c) is Element and c.tag == tag])

    def find(self, tag: str) -> Element | None:
        """The first child element with this name."""
        for child in self.children:
            if type(child) is Element and child.tag == tag:
                return child
        return None

    def descendants(self) -> Iterator[Element]:
        """Every element below this one, in document order."""
        pending = list(self.elements())[::-1]
        while pending:
            element = pending.pop()
            yield element
            pending.extend(list(element.elements())[::-1])

    @property
    def text(self) -> str:
        """The character data of the element itself, without comments and instructions."""
        return "".join(
            c.value for c in self.children if isinstance(c, Text) and not isinstance(c, Comment | Instruction)
        )

    @property
    def text_origin(self) -> Origin:
        """The origin of the text without the white space around it. That of the element if it is not a single
        text."""
        only = self.children[0] if len(self.children) == 1 else None
        if type(only) is not Text or not only.value.strip():
            return self.origin
        written = only.source.data[only.start : only.end]
        start, end = only.start + len(written) - len(written.lstrip()), only.start + len(written.rstrip())
        return Origin(Span(only.source, start, end), only.call)

    @property
    def end(self) -> int:
        """The offset after the end tag, or after the tag itself if the element is empty."""
        data, tag_end = self.source.data, self.tag_end
        return tag_end if self._close < 0 or data[tag_end - 2] == 0x2F else markup_end(data, self._close)

    @property
    def tag_end(self) -> int:
        """The offset after the start tag."""
        return _tag_end(self.source, self.start)

    @property
    def origin(self) -> Origin:
        """The span of the start tag, and the calls that led to the element."""
        return _LazyOrigin(self, None)

    @property
    def whole(self) -> Span:
        """The span from the start tag to the end tag."""
        return Span(self.source, self.start, self.end)

    def attribute_origin(self, name: str) -> Origin:
        """The span of an attribute's value (without quotes), or of the start tag if it is missing."""
        if self.moved and name in self.moved:
            return self.moved[name]
        return _LazyOrigin(self, name)

    def attribute_spans(self) -> Mapping[str, tuple[Span, Span]]:
        """The spans of the name and the value (without quotes) of every attribute in the start tag."""
        return _attribute_spans(self.source, self.start)


class _LazyOrigin(Origin):
    """The origin of an element or of an attribute's value. Its span is computed at the first use.

    A robot has one for each of its parts, and few are ever used.
    """

    __slots__ = ("_attribute", "_element")

    def __init__(self, element: Element, attribute: str | None) -> None:
        self._element = element
        self._attribute = attribute
        self.call = element.call

    def __getattr__(self, name: str) -> Span:
        """Compute `span` at the first use."""
        if name != "span":
            raise AttributeError(name)
        element, attribute = self._element, self._attribute
        spans = element.attribute_spans().get(attribute) if attribute is not None else None
        self.span = spans[1] if spans else Span(element.source, element.start, element.tag_end)
        return self.span


class XmlDocument:
    """A parsed file: the nodes before the root, the root, and the nodes after it.

    `diagnostics` are errors that still leave a usable tree. `nodes` counts elements and comments, `depth`
    levels of elements.
    """

    __slots__ = ("after", "before", "depth", "diagnostics", "nodes", "root", "source")

    def __init__(self, source: Source) -> None:
        self.source = source
        self.root: Element
        self.before: list[Text] = []
        self.after: list[Text] = []
        self.diagnostics: tuple[Diagnostic, ...] = ()
        self.nodes = self.depth = 0


@lru_cache(maxsize=8)  # each attribute of a tag needs it, and there may be thousands
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
    """The offset after the markup that begins at `at`, or `at` if no markup begins there."""
    for opening, closing in ((b"<!--", b"-->"), (b"<![CDATA[", b"]]>"), (b"]]>", b"]]>"), (b"<?", b"?>")):
        if data.startswith(opening, at):
            end = data.find(closing, at)
            return end + len(closing) if end >= 0 else len(data)
    match = _TAG.match(data, at)
    return match.end() if match else at
