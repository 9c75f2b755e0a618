"""Finds the exact position of a part of an attribute's value or of a text."""

from __future__ import annotations

import re

from kbot.text.span import Call, Origin, Span
from kbot.text.xml import CData, Comment, Element, Text

UNIT = re.compile(r"&[^&;]*;|\r\n|.", re.DOTALL)
"""What the parser reads as one character: an entity, a line end, or a character."""
_LONGEST = 200_000
"""Bytes of the longest value whose parts are located. In longer values, errors point at the whole value."""
_BLANKS = str.maketrans("\n\t", "  ")


def locate(node: Element | Text, attribute: str, call: Call | None, part: tuple[int, int] | None) -> Origin:
    """The origin of the characters `part` of an attribute's value or of a text. None means all of it."""
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
    """The span of the characters `start` to `end` of a value; the whole span if they cannot be located."""
    if span.end - span.start > _LONGEST:
        return span
    written = [match[0] for match in UNIT.finditer(span.text)]
    if len(written) != len(value) or _decoded("".join(written)) != _decoded(value, entities=False):
        return span
    first = sum(len(unit.encode("utf-8", "surrogatepass")) for unit in written[:start])
    length = sum(len(unit.encode("utf-8", "surrogatepass")) for unit in written[start:end])
    return Span(span.source, span.start + first, span.start + first + length)


def name_span(node: Element, attribute: str, call: Call | None) -> Origin:
    """The origin of an attribute's name."""
    spans = node.attribute_spans().get(attribute)
    return Origin(spans[0], call) if spans else Origin(node.origin.span, call)


def _decoded(text: str, entities: bool = True) -> str:
    import html  # only for an error: start-up time

    return (html.unescape(text) if entities else text).replace("\r\n", "\n").translate(_BLANKS)
