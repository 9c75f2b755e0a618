"""The exact place of a piece of an attribute's value or of a text."""

from __future__ import annotations

import re

from kbot.text.span import Call, Origin, Span
from kbot.text.xml import CData, Comment, Element, Text

UNIT = re.compile(r"&[^&;]*;|\r\n|.", re.DOTALL)
"""What is one character to the parser: an entity, a line end, a character."""
_LONGEST = 200_000
"""Bytes of a value beyond which only the whole of it is pointed at."""
_BLANKS = str.maketrans("\n\t", "  ")


def locate(node: Element | Text, attribute: str, call: Call | None, part: tuple[int, int] | None) -> Origin:
    """The origin of characters `part` of an attribute's value or of a text; the whole where it is None."""
    if isinstance(node, Element):
        if not attribute:
            return Origin(node.origin.span, call)
        span = node.attribute_origin(attribute).span
        value = node.attributes.get(attribute, "")
    else:
        span, value = node.origin.span, node.value
        if isinstance(node, Comment):
            span = Span(span.source, span.start + 4, max(span.end - 3, span.start + 4))
        elif isinstance(node, CData):
            return Origin(span, call)
    if part is not None:
        span = within(span, value, *part)
    return Origin(span, call)


def within(span: Span, value: str, start: int, end: int) -> Span:
    """Characters `start` to `end` of a value that was written in a span; the span if it was not."""
    if span.end - span.start > _LONGEST:
        return span
    written = [match[0] for match in UNIT.finditer(span.text)]
    if len(written) != len(value) or _decoded("".join(written)) != _decoded(value, entities=False):
        return span
    first = sum(len(unit.encode("utf-8", "surrogatepass")) for unit in written[:start])
    length = sum(len(unit.encode("utf-8", "surrogatepass")) for unit in written[start:end])
    return Span(span.source, span.start + first, span.start + first + length)


def name_span(node: Element, attribute: str, call: Call | None) -> Origin:
    """Where the name of an attribute stands."""
    spans = node.attribute_spans().get(attribute)
    return Origin(spans[0], call) if spans else Origin(node.origin.span, call)


def _decoded(text: str, entities: bool = True) -> str:
    import html  # only where something is wrong

    return (html.unescape(text) if entities else text).replace("\r\n", "\n").translate(_BLANKS)
