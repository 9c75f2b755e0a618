"""Builds the source edits of fixes, only for values written without expressions."""

from __future__ import annotations

from collections.abc import Iterable

from kbot.text import Edit, Element, Fix, Span


def set_value(span: Span, text: str) -> tuple[Edit, ...]:
    """Replace the value between an attribute's quotes. No edit if the text is the same."""
    return () if span.text == text else (Edit(span, text),)


def is_plain(span: Span) -> bool:
    """Whether a span contains no expression."""
    return "$" not in span.text


def set_attribute(element: Element, name: str, text: str) -> tuple[Edit, ...]:
    """Set an attribute. If the element does not have it, add it after the other attributes."""
    spans = element.attribute_spans()
    if name in spans:
        return set_value(spans[name][1], text)
    data, at = element.source.data, element.tag_end - 1
    if data[at - 1 : at] == b"/":
        at -= 1
    while data[at - 1 : at].isspace():
        at -= 1
    return (Edit(Span(element.source, at, at), f' {name}="{text}"'),)


def replace_value(element: Element | None, name: str, text: str, title: str, safe: bool) -> Fix | None:
    spans = element.attribute_spans() if element is not None else {}
    if name not in spans or not is_plain(spans[name][1]):
        return None
    edits = set_value(spans[name][1], text)
    return Fix(title, edits, safe) if edits else None


def rename_attribute(element: Element | None, old: str, new: str, safe: bool) -> Fix | None:
    spans = element.attribute_spans() if element is not None else {}
    if old not in spans or new in spans:
        return None
    return Fix(f"rename {old} to {new}", (Edit(spans[old][0], new),), safe)


def rename_tag(element: Element | None, new: str, safe: bool) -> Fix | None:
    """Rename an element in its start tag and, if it has one, its end tag."""
    if element is None:
        return None
    source, old = element.source, element.tag.encode()
    start = element.start + 1
    if source.data[start : start + len(old)] != old:
        return None
    edits = [Edit(Span(source, start, start + len(old)), new)]
    closing = source.data.rfind(b"</" + old, element.tag_end, element.end)
    if source.data[element.tag_end - 2 : element.tag_end] != b"/>":
        if closing < 0:
            return None
        edits.append(Edit(Span(source, closing + 2, closing + 2 + len(old)), new))
    return Fix(f"rename <{element.tag}> to <{new}>", tuple(edits), safe)


def remove_attributes(element: Element | None, names: Iterable[str], safe: bool) -> Fix | None:
    """Remove attributes, with the white space before them."""
    if element is None:
        return None
    spans = element.attribute_spans()
    edits = []
    for name in names:
        if name in spans:
            key, value = spans[name]
            start, data = key.start, key.source.data
            while data[start - 1 : start].isspace():
                start -= 1
            edits.append(Edit(Span(key.source, start, value.end + 1), ""))
    title = "remove " + " and ".join(n for n in names if n in spans)
    return Fix(title, tuple(edits), safe) if edits else None


def remove_element(element: Element, safe: bool, title: str = "") -> Fix:
    """Remove an element, and its line if nothing else is on it."""
    span = with_line(element.whole)
    return Fix(title or f"remove <{element.tag}>", (Edit(span, ""),), safe)


def with_line(span: Span) -> Span:
    """The span, extended by its indentation and line end if nothing else is on its lines."""
    data = span.source.data
    start, end = span.start, span.end
    while start > 0 and data[start - 1 : start] in (b" ", b"\t"):
        start -= 1
    while data[end : end + 1] in (b" ", b"\t"):
        end += 1
    if start > 0 and data[start - 1 : start] != b"\n":
        return span
    if data[end : end + 2] == b"\r\n":
        return Span(span.source, start, end + 2)
    if data[end : end + 1] == b"\n":
        return Span(span.source, start, end + 1)
    return span


def insert_child(element: Element, text: str, title: str, safe: bool) -> Fix | None:
    """Insert a first child on its own line, indented like the other children."""
    source = element.source
    data, at = source.data, element.tag_end
    if data[at - 2 : at] == b"/>":
        return None
    line, _ = source.line_column(element.start)
    indent = source.line(line)[: len(source.line(line)) - len(source.line(line).lstrip())]
    first = next(element.elements(), None)
    deeper = indent + "  "
    if first is not None and first.source is source:
        row = source.line(source.line_column(first.start)[0])
        if row.lstrip().startswith("<" + first.tag):
            deeper = row[: len(row) - len(row.lstrip())]
    return Fix(title, (Edit(Span(source, at, at), f"{source.line_end}{deeper}{text}"),), safe)


def insert_after(element: Element, text: str, title: str, safe: bool) -> Fix:
    """Insert a text on its own line after an element, indented like the element's line."""
    source = element.source
    line = source.line(source.line_column(element.start)[0])
    indent = line[: len(line) - len(line.lstrip())]
    at = Span(source, element.end, element.end)
    return Fix(title, (Edit(at, f"{source.line_end}{indent}{text}"),), safe)


def copy_as_collision(visual: Element) -> Fix:
    """Insert a `<collision>` after a visual, with the visual's origin and geometry as written."""
    source = visual.source
    line = source.line(source.line_column(visual.start)[0])
    indent = line[: len(line) - len(line.lstrip())]
    end = source.line_end
    inner = [e.whole.text for e in visual.elements() if e.tag in ("origin", "geometry")]
    text = end.join(
        ["", f"{indent}<collision>", *(f"{indent}  {piece}" for piece in inner), f"{indent}</collision>"]
    )
    return Fix(
        "copy the visual as collision", (Edit(Span(source, visual.end, visual.end), text),), safe=False
    )
