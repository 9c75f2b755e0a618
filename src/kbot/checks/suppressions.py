"""`<!-- kbot: ignore[CODE] why -->` on a line or above it, and comments that suppress nothing."""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass

from kbot.checks.edits import with_line
from kbot.checks.registry import Rule, near_rules
from kbot.text import Diagnostic, Edit, Fix, Origin, Severity, Source, Span

_COMMENT = re.compile(rb"<!--\s*kbot:(.*?)(-->|\Z)", re.DOTALL)
_IGNORE = re.compile(r"ignore\s*\[([^\]]*)\]\s*(.*)", re.DOTALL)
_MARK = b"kbot:"


@dataclass(slots=True)
class Suppression:
    """One comment: the lines it speaks for, the codes it names."""

    span: Span
    lines: range
    codes: tuple[str, ...]
    used: set[str]

    def covers(self, diagnostic: Diagnostic) -> bool:
        origin = diagnostic.origin
        if origin is None:
            return False
        code = next((c for c in self.codes if diagnostic.code == c or c == "ALL"), None)
        if code is None or not any(self._at(s) for s in (origin.span, *(c.span for c in origin.stack))):
            return False
        self.used.add(code)
        return True

    def _at(self, span: Span) -> bool:
        return span.file == self.span.file and span.line in self.lines


def without_suppressed(
    found: Sequence[Diagnostic], sources: Iterable[Source], rules: Mapping[str, Rule]
) -> list[Diagnostic]:
    """Findings that no comment suppresses, and one (K001) for each comment that suppresses nothing."""
    marked = [s for s in sources if _MARK in s.data]
    if not marked:
        return list(found)
    comments: list[Suppression] = []
    kept: list[Diagnostic] = []
    for source in marked:
        for match in _COMMENT.finditer(source.data):
            if not match[2]:
                break  # it is not closed: the file is not well-formed, and reported for that
            span = Span(source, match.start(), match.end())
            read = _read(span, match[1].decode("utf-8", "replace").strip(), rules)
            if isinstance(read, Diagnostic):
                kept.append(read)
            else:
                comments.append(read)
    for diagnostic in found:
        # every comment is asked, so that each learns whether it is used
        covered = [c.covers(diagnostic) for c in comments]
        kept += [] if any(covered) else [diagnostic]
    kept += [d for c in comments if (d := _unused(c))]
    return kept


def _read(span: Span, text: str, rules: Mapping[str, Rule]) -> Suppression | Diagnostic:
    match = _IGNORE.fullmatch(text)
    codes = tuple(code.strip() for code in match[1].split(",") if code.strip()) if match else ()
    unknown = next((c for c in codes if c not in rules and c != "ALL"), None)
    if not match or not codes or unknown:
        message = f"there is no rule '{unknown}'" if unknown else f"'kbot: {text}' is not understood"
        hint = near_rules(unknown) if unknown else ""
        hint = hint or "written <!-- kbot: ignore[CODE] why -->"
        return Diagnostic("K002", Severity.WARNING, message, Origin(span), hint)
    first = span.line
    source = span.source
    last = source.line_column(span.end)[0]
    before = source.line(first)[: span.column - 1].strip()
    after = source.line(last)[source.line_column(span.end)[1] - 1 :].strip()
    lines = range(first, last + 1) if before or after else range(first, _next_line(source, last) + 1)
    return Suppression(span, lines, codes, set())


def _next_line(source: Source, line: int) -> int:
    """The next line that has anything but comments on it."""
    for number in range(line + 1, source.line_count + 1):
        text = source.line(number).strip()
        if text and not (text.startswith("<!--") and text.endswith("-->")):
            return number
    return line


def _unused(comment: Suppression) -> Diagnostic | None:
    unused = [code for code in comment.codes if code not in comment.used]
    if not unused:
        return None
    message = f"the comment suppresses nothing: there is no {', '.join(unused)} here"
    fix = None
    if len(unused) == len(comment.codes):
        fix = Fix("remove the comment", (Edit(with_line(comment.span), ""),), safe=True)
    return Diagnostic("K001", Severity.INFO, message, Origin(comment.span), fix=fix)
