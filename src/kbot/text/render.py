"""Renders diagnostics as text with source excerpts, and as JSON."""

from __future__ import annotations

import os
import textwrap
import unicodedata
from collections.abc import Iterable, Sequence
from functools import lru_cache

from kbot.text.diagnostic import Diagnostic, Severity
from kbot.text.escapes import with_escapes
from kbot.text.span import Call, Origin, Span

_COLORS = {Severity.ERROR: "1;31", Severity.WARNING: "1;33", Severity.INFO: "1;36"}
_FRAME_WIDTH = 160
"""Columns of an excerpt if the width of the terminal is unknown."""
_STACK_SHOWN = 8
"""Macro calls and includes that are listed: the innermost ones, and the outermost."""
_PLACES_SHOWN = 2
"""Related places that are printed with their lines: an example of the uses, or both ends of a conflict."""
_SPACES = str.maketrans("\n\r\t", "   ")
_TAB = 4
"""Columns between tab stops in an excerpt."""


def render_text(
    diagnostics: Iterable[Diagnostic],
    *,
    color: bool = False,
    width: int | None = None,
    every_place: bool = False,
) -> str:
    """Diagnostics as text. Each ends with a newline.

    `width` is the terminal's width in columns. Notes are wrapped to it, and long source lines are cropped
    around the caret. None, for pipes, wraps nothing. `every_place` prints all related places instead of two.
    """
    text = _Text(color, width, None if every_place else _PLACES_SHOWN)
    return "\n".join(text.render(diagnostic) for diagnostic in diagnostics)


def to_json(diagnostic: Diagnostic) -> dict[str, object]:
    """A diagnostic as plain values. `file`, `line` and `column` are None if no text is involved."""
    stack = diagnostic.origin.stack if diagnostic.origin else ()
    result: dict[str, object] = {
        "code": diagnostic.code,
        "severity": str(diagnostic.severity),
        "message": diagnostic.message,
        **_place(diagnostic.origin.span if diagnostic.origin else None),
        "hint": diagnostic.hint,
        "stack": [{"kind": call.kind, "name": call.name, **_start(call.span)} for call in stack],
        "related": [{"message": r.message, **_place(r.origin.span)} for r in diagnostic.related],
    }
    if diagnostic.fix:
        result["fix"] = {
            "title": diagnostic.fix.title,
            "safe": diagnostic.fix.safe,
            "edits": [{**_place(e.span), "replacement": e.replacement} for e in diagnostic.fix.edits],
        }
    return result


def count(diagnostics: Iterable[Diagnostic]) -> str:
    """A count such as `2 errors, 1 warning`. Empty if there are no diagnostics."""
    found = [d.severity for d in diagnostics]
    numbers = [(found.count(Severity.ERROR), "error"), (found.count(Severity.WARNING), "warning")]
    parts = [f"{n} {word}{'s' * (n != 1)}" for n, word in numbers if n]
    notes = found.count(Severity.INFO)
    return ", ".join([*parts, *([f"{notes} info"] if notes else [])])


def place(origin: Origin) -> str:
    """`file:line:column` as it is printed."""
    return printable(_at(origin))


def _start(span: Span) -> dict[str, object]:
    line, column = span.source.line_column(span.start)
    return {"file": span.file, "line": line, "column": column}


def _place(span: Span | None) -> dict[str, object]:
    if span is None:
        return {"file": None, "line": None, "column": None, "end_line": None, "end_column": None}
    line, column = span.source.line_column(span.end)
    return {**_start(span), "end_line": line, "end_column": column}


class _Text:
    def __init__(self, color: bool, width: int | None, most_places: int | None) -> None:
        self.color, self.width, self.most_places = color, width, most_places

    def render(self, diagnostic: Diagnostic) -> str:
        tone = _COLORS[diagnostic.severity]
        where = f"{place(diagnostic.origin)}: " if diagnostic.origin else ""
        severity = self._paint(f"{diagnostic.severity}:", tone)
        lines = [
            f"{self._paint(where, '1')}{severity} {printable(diagnostic.message)} "
            f"{self._paint(f'[{diagnostic.code}]', '2')}"
        ]
        others = [related for related in diagnostic.related if not related.is_in_message]
        shown = others[: self.most_places]
        spans = [o.span for o in (diagnostic.origin, *(r.origin for r in shown)) if o]
        margin = max((len(str(span.line)) for span in spans), default=1) + 1
        if diagnostic.origin:
            lines += self._frame(diagnostic.origin.span, margin, tone)
            lines += self._stack(diagnostic.origin, margin)
        if diagnostic.hint:
            lines += self._note(margin, diagnostic.hint, "hint")
        if diagnostic.fix:
            label = "fix" if diagnostic.fix.safe else "possible fix"
            lines += self._note(margin, diagnostic.fix.title, label)
        for related in shown:
            lines += self._note(margin, f"{_at(related.origin)}: {related.message}")
            lines += self._frame(related.origin.span, margin, _COLORS[Severity.INFO])
        more = len(others) - len(shown)
        if more:
            lines += self._note(margin, f"and {more} more place{'s' * (more > 1)}")
        return "\n".join(lines) + "\n"

    def _frame(self, span: Span, margin: int, tone: str) -> list[str]:
        """The first source line of a span, with carets below the span."""
        number, column = span.source.line_column(span.start)
        raw = span.source.line(number)
        if not raw.strip():
            return []
        last, end = span.source.line_column(span.end)
        stop = len(raw.rstrip()) if last > number else min(end - 1, len(raw))
        text, starts = _laid_out(raw)
        first = starts[min(column - 1, len(raw))]
        until = max(starts[max(stop, 0)], first + 1)
        text, first, until = _crop(text, first, until, (self.width or _FRAME_WIDTH) - margin - 3)
        bar = self._paint(" " * margin + "|", "34")
        lead = " " * _columns(text[:first])
        carets = "^" * max(_columns(text[first:until]), 1)
        return [
            bar,
            f"{self._paint(f'{number:>{margin - 1}} |', '34')} {text}",
            f"{bar} {lead}{self._paint(carets, tone)}",
        ]

    def _stack(self, origin: Origin, margin: int) -> list[str]:
        calls = origin.stack
        lines: list[str] = []
        for at, call in enumerate(calls):
            if len(calls) > _STACK_SHOWN and at == _STACK_SHOWN - 1:
                lines += self._note(margin, f"… {len(calls) - at - 1} more …")
                return lines + self._note(margin, _call(calls[-1]))
            lines += self._note(margin, _call(call))
        return lines

    def _note(self, margin: int, text: str, label: str = "") -> list[str]:
        pieces = [printable(text)]
        prefix = f"{label}: " if label else ""
        indent = margin + 2 + len(prefix)
        if self.width:
            room = max(self.width - indent, 30)
            pieces = textwrap.wrap(pieces[0], room, break_long_words=False, break_on_hyphens=False) or [""]
        head = " " * margin + self._paint("=", "34") + " " + self._paint(prefix, "1")
        return [head + pieces[0], *(" " * indent + piece for piece in pieces[1:])]

    def _paint(self, text: str, tone: str) -> str:
        return f"\x1b[{tone}m{text}\x1b[0m" if self.color and text else text


def _call(call: Call) -> str:
    if call.kind == "macro":
        return f"in macro '{call.name}' called at {_at(call)}"
    return f"included from {_at(call)}"


def _at(what: Origin | Call) -> str:
    """`file:line:column`. The path is relative if the file is below the working directory."""
    path, here = what.span.file, os.path.join(os.getcwd(), "")
    text = str(what.span)
    return text.removeprefix(here) if os.path.isabs(path) else text


def printable(text: str) -> str:
    """Replace control characters by visible ones: a file must not be able to control the terminal."""
    return text if text.isprintable() else with_escapes(text.translate(_SPACES))


def encodable(text: str) -> str:
    """Replace what UTF-8 cannot express by visible characters: file names may have any bytes."""
    return text.encode("utf-8", "backslashreplace").decode("utf-8")


@lru_cache(maxsize=4)  # many findings may be in one long line
def _laid_out(raw: str) -> tuple[str, Sequence[int]]:
    """A line as it is printed, and the position of each of its characters (and of its end) in it."""
    shown, starts, at = [], [], 0
    for character in raw:
        starts.append(at)
        if character == "\t":
            piece = " " * (_TAB - at % _TAB)
        else:
            piece = character if character.isprintable() else "\N{REPLACEMENT CHARACTER}"
        shown.append(piece)
        at += len(piece)
    return "".join(shown), [*starts, at]


def _crop(text: str, first: int, until: int, room: int) -> tuple[str, int, int]:
    """The part of a long line that contains the marked span, with `…` at its cut ends."""
    room = max(room, 20)
    if len(text) <= room:
        return text, first, until
    left = max(0, min(first - room // 3, len(text) - room))
    right = left + room
    piece = ("…" if left else "") + text[left + bool(left) : right - (right < len(text))]
    if right < len(text):
        piece += "…"
    first, until = max(first - left, 0), min(until - left, len(piece))
    return piece, first, max(until, first + 1)


def _columns(text: str) -> int:
    """The terminal columns of a text: two for each wide character, none for a combining character."""
    return sum(
        0 if unicodedata.combining(c) else 2 if unicodedata.east_asian_width(c) in "WF" else 1 for c in text
    )
