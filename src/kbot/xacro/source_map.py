"""The source map: where each element, attribute and line of an expansion comes from.

The map is built on first use. It parses the text of the expansion again to get the position of every element
in the result, and walks both trees side by side.
"""

from __future__ import annotations

import json
from bisect import bisect_right
from dataclasses import dataclass

from kbot.text.errors import DescriptionError
from kbot.text.span import Call, Origin, Source, Span
from kbot.text.xml import Element, parse_document
from kbot.xacro.location import within
from kbot.xacro.templates import pieces
from kbot.xacro.xacro_error import XacroError

TYPE_CHECKING = False
if TYPE_CHECKING:
    from collections.abc import Iterator
    from typing import Any

    from kbot.xacro.binding import Binding

VERSION = 1


@dataclass(frozen=True, slots=True)
class Trace:
    """One element or attribute of the result.

    output        its position in the expansion's text
    origin        where it was written, and the calls that led there
    expressions   the spans of the `${…}` and `$(…)` that its value was computed from
    inputs        the properties and parameters that these looked up, each with its origin
    """

    element: Element
    attribute: str | None
    output: Span
    origin: Origin
    expressions: tuple[Span, ...] = ()
    inputs: tuple[Binding, ...] = ()

    @property
    def name(self) -> str:
        if self.attribute is not None:
            return f"{self.element.tag}@{self.attribute}"
        name = self.element.attributes.get("name")
        return f"{self.element.tag} '{name}'" if name else self.element.tag


class SourceMap:
    """Traces of an expansion, by position in the result and by name."""

    def __init__(self, document: Element | None, text: str) -> None:
        """`text` is the serialised document."""
        self._text = Source("", text)
        self._pairs: list[tuple[Element, Element]] = []
        if document is not None:
            try:
                written = parse_document(self._text).root
            except DescriptionError:
                return
            self._pairs = [
                (document, written),
                *zip(document.descendants(), written.descendants(), strict=True),
            ]
        self._starts = [written.start for _, written in self._pairs]

    def elements(self) -> Iterator[Trace]:
        """Every element of the result, in order."""
        for element, written in self._pairs:
            yield Trace(element, None, written.whole, element.origin)

    def attributes(self, element: Element) -> Iterator[Trace]:
        """The attributes of an element of the result, in order."""
        written = next((w for e, w in self._pairs if e is element), None)
        if written is not None:
            yield from self._attributes(element, written)

    def at(self, line: int, column: int = 1) -> Trace | None:
        """The attribute or innermost element at a position of the result. Line and column are 1-based."""
        offset = self._text.offset(line, column)
        at = bisect_right(self._starts, offset) - 1
        if column == 1 and at + 1 < len(self._starts):
            # the start of a line means the first tag on it
            first = self._starts[at + 1]
            at += self._text.line_column(first)[0] == line
        while at >= 0:
            element, written = self._pairs[at]
            if offset < written.end:
                for trace in self._attributes(element, written):
                    if trace.output.start <= offset < trace.output.end:
                        return trace
                return Trace(element, None, written.whole, element.origin)
            at -= 1
        return None

    def find(self, name: str, tag: str | None = None) -> list[Trace]:
        """The elements of the result with this name: of all tags, or of `tag`."""
        return [
            trace
            for trace in self.elements()
            if trace.element.attributes.get("name") == name and tag in (None, trace.element.tag)
        ]

    def names(self) -> list[str]:
        """Every name in the result."""
        return sorted({e.attributes["name"] for e, _ in self._pairs if "name" in e.attributes})

    def _attributes(self, element: Element, written: Element) -> Iterator[Trace]:
        inputs = element.inputs or {}
        for name, (start, value) in written.attribute_spans().items():
            origin = element.attribute_origin(name)
            output = Span(self._text, start.start, value.end + 1)
            yield Trace(element, name, output, origin, expressions(origin.span), inputs.get(name, ()))

    def to_json(self) -> str:
        """The map as JSON. `docs/reference/source-map.md` describes the format."""
        return json.dumps(_Writer(self).document(), ensure_ascii=False, separators=(",", ":")) + "\n"


def expressions(span: Span) -> tuple[Span, ...]:
    """The spans of the expressions and commands in a value in the source."""
    text = span.text
    if "$" not in text:
        return ()
    try:
        found = [piece for piece in pieces(text) if piece.kind != "text"]
    except XacroError:
        return ()
    return tuple(within(span, text, piece.start, piece.end) for piece in found)


class _Writer:
    """Builds the JSON. Numbers files, calls and bindings in the order of occurrence."""

    def __init__(self, source_map: SourceMap) -> None:
        self.map = source_map
        self.files: dict[str, int] = {}
        self.calls: dict[int, int] = {}
        self.bindings: dict[int, int] = {}
        self.call_list: list[dict[str, Any]] = []  # Any: JSON
        self.binding_list: list[dict[str, Any]] = []

    def document(self) -> dict[str, Any]:
        elements = [self.element(element, written) for element, written in self.map._pairs]
        return {
            "version": VERSION,
            "files": list(self.files),
            "calls": self.call_list,
            "bindings": self.binding_list,
            "elements": elements,
        }

    def element(self, element: Element, written: Element) -> dict[str, Any]:
        entry: dict[str, Any] = {
            "tag": element.tag,
            "output": self.output(written.whole),
            "source": self.span(element.origin.span),
            "call": self.call(element.call),
            "attributes": {},
        }
        if "name" in element.attributes:
            entry["name"] = element.attributes["name"]
        for trace in self.map._attributes(element, written):
            about: dict[str, Any] = {
                "output": self.output(trace.output),
                "source": self.span(trace.origin.span),
            }
            if trace.expressions:
                about["expressions"] = [self.span(span) for span in trace.expressions]
            if trace.inputs:
                about["bindings"] = [self.binding(binding) for binding in trace.inputs]
            entry["attributes"][trace.attribute] = about
        return entry

    def output(self, span: Span) -> list[int]:
        return [*span.source.line_column(span.start), *span.source.line_column(span.end)]

    def span(self, span: Span) -> list[int]:
        return [self.files.setdefault(span.file, len(self.files)), *self.output(span)]

    def call(self, call: Call | None) -> int | None:
        if call is None:
            return None
        number = self.calls.get(id(call))
        if number is None:
            caller = self.call(call.caller)
            number = self.calls[id(call)] = len(self.call_list)
            self.call_list.append(
                {"kind": call.kind, "name": call.name, "source": self.span(call.span), "caller": caller}
            )
        return number

    def binding(self, binding: Binding) -> int:
        """The number of a binding. Numbers also its inputs, without recursion: the chain may be long."""
        waiting: list[Binding] = []
        number = self._number(binding, waiting)
        while waiting:
            current = waiting.pop()
            entry = self.binding_list[self.bindings[id(current)]]
            origin = current.origin
            entry["source"] = self.span(origin.span) if origin else None
            entry["call"] = self.call(current.call)
            entry["bindings"] = [self._number(inner, waiting) for inner in current.inputs]
        return number

    def _number(self, binding: Binding, new: list[Binding]) -> int:
        number = self.bindings.get(id(binding))
        if number is None:
            number = self.bindings[id(binding)] = len(self.binding_list)
            self.binding_list.append({"name": binding.name, "value": _shown(binding.value)})
            new.append(binding)
        return number


def _shown(value: object) -> str | float | bool | None:
    """A value that JSON can express. Long texts are shortened."""
    if isinstance(value, bool | int | str) or value is None:
        return value if not isinstance(value, str) or len(value) < 200 else value[:197] + "…"
    if isinstance(value, float):
        return value if value == value and abs(value) != float("inf") else str(value)
    return f"<{type(value).__name__}>"
