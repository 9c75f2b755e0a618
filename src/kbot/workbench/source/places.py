"""Diagnostics and origins as messages of the page."""

from __future__ import annotations

from collections.abc import Iterable

from kbot.text import Diagnostic, Edit, Origin, Span
from kbot.workbench.protocol import Finding, Note, Place, Step, TextEdit
from kbot.workbench.source.ownership import Ownership


def place(origin: Origin | None) -> Place | None:
    """Return the place of an origin for the page."""
    return place_of_span(origin.span) if origin is not None else None


def place_of_span(span: Span) -> Place:
    """Return the first line of a span, at least one character long."""
    line, column = span.source.line_column(span.start)
    rest = len(span.source.line(line)) - column + 1
    width = len(span.text.split("\n", 1)[0].rstrip("\r"))
    return Place(span.file, line, column, max(1, min(width, rest)))


def findings_for_page(diagnostics: Iterable[Diagnostic], ownership: Ownership) -> tuple[Finding, ...]:
    """Return diagnostics for the page, in the same order."""
    return tuple(_finding(diagnostic, ownership) for diagnostic in diagnostics)


def _finding(diagnostic: Diagnostic, ownership: Ownership) -> Finding:
    origin = diagnostic.origin
    return Finding(
        code=diagnostic.code,
        severity=diagnostic.severity.value,
        message=diagnostic.message,
        hint=diagnostic.hint,
        place=place(origin),
        stack=tuple(
            Step(call.kind, call.name, place_of_span(call.span)) for call in (origin.stack if origin else ())
        ),
        related=tuple(Note(note.message, place_of_span(note.origin.span)) for note in diagnostic.related),
        link=ownership.link_at(origin),
        fix=diagnostic.fix.title if diagnostic.fix else "",
        edits=tuple(map(_text_edit, diagnostic.fix.edits)) if diagnostic.fix else (),
    )


def _text_edit(edit: Edit) -> TextEdit:
    source = edit.span.source
    start, end = source.line_column(edit.span.start), source.line_column(edit.span.end)
    return TextEdit(source.path, *start, *end, edit.replacement)
