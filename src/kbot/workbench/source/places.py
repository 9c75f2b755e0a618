"""Diagnostics and origins as messages of the page."""

from __future__ import annotations

from collections.abc import Sequence

from kbot.text import Diagnostic, Edit, Origin, Severity, Span
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


MOST_FINDINGS = 500
"""Findings that a page lists. It takes a second to draw some thousands, which nobody reads."""


def findings_for_page(
    diagnostics: Sequence[Diagnostic], ownership: Ownership, others: Sequence[Diagnostic] = ()
) -> tuple[Finding, ...]:
    """Return the first `MOST_FINDINGS` diagnostics for the page in the same order, a K004 that counts the
    omitted ones, and then the first of the others."""
    shown = (*_first(diagnostics), *_first(others))
    return tuple(_finding(diagnostic, ownership) for diagnostic in shown)


def _first(diagnostics: Sequence[Diagnostic]) -> Sequence[Diagnostic]:
    omitted = len(diagnostics) - MOST_FINDINGS
    if omitted <= 0:
        return diagnostics
    message = f"{omitted:,} more findings are not listed here"
    more = Diagnostic("K004", Severity.WARNING, message, None, "`kbot check -v` lists all findings")
    return (*diagnostics[:MOST_FINDINGS], more)


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
