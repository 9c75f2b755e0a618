"""Applies comments `<!-- kbot: ignore[CODE] reason -->` on or above a line, and reports unused ones."""

from __future__ import annotations

import re
from collections import defaultdict
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass

from kbot.checks.edits import with_line
from kbot.checks.former_codes import FORMER_CODES, covers
from kbot.checks.registry import Rule, near_rules
from kbot.text import Diagnostic, Edit, Fix, Origin, Severity, Source, Span

_COMMENT = re.compile(rb"<!--\s*kbot:(.*?)(-->|\Z)", re.DOTALL)
_IGNORE = re.compile(r"ignore\s*\[([^\]]*)\]\s*(.*)", re.DOTALL)
_MARK = b"kbot:"


@dataclass(slots=True)
class Suppression:
    """One comment: the lines it applies to, its codes, and the codes that suppressed a finding."""

    span: Span
    lines: Sequence[int]
    codes: tuple[str, ...]
    used: set[str]

    def covers(self, diagnostic: Diagnostic) -> bool:
        """Whether it names the code of a finding on one of its lines. Marks the code as used."""
        code = next((c for c in self.codes if c == "ALL" or covers(c, diagnostic.code)), None)
        if code is None:
            return False
        self.used.add(code)
        return True


def without_suppressed(
    found: Sequence[Diagnostic], sources: Iterable[Source], rules: Mapping[str, Rule]
) -> list[Diagnostic]:
    """The findings that no comment suppresses, plus K001 for each comment that suppresses nothing."""
    marked = [s for s in sources if _MARK in s.data]
    if not marked:
        return list(found)
    comments: list[Suppression] = []
    kept: list[Diagnostic] = []
    for source in marked:
        next_lines = _next_lines(source)
        for match in _COMMENT.finditer(source.data):
            if not match[2]:
                break  # not closed: the file is not well-formed, which is reported elsewhere
            span = Span(source, match.start(), match.end())
            read = _read(span, match[1].decode("utf-8", "replace").strip(), rules, next_lines)
            if isinstance(read, Diagnostic):
                kept.append(read)
            else:
                comments.append(read)
    by_line: dict[tuple[str, int], list[Suppression]] = defaultdict(list)
    for comment in comments:
        for line in comment.lines:
            by_line[comment.span.file, line].append(comment)
    for diagnostic in found:
        origin = diagnostic.origin
        spans = (origin.span, *(call.span for call in origin.stack)) if origin else ()
        near = [c for place in {(s.file, s.line) for s in spans} for c in by_line.get(place, ())]
        # no short circuit: `covers` marks every matching comment as used
        covered = [c.covers(diagnostic) for c in near]
        kept += [] if any(covered) else [diagnostic]
    kept += [d for c in comments if (d := _unused(c))]
    return kept


def _read(
    span: Span, text: str, rules: Mapping[str, Rule], next_lines: Mapping[int, int]
) -> Suppression | Diagnostic:
    match = _IGNORE.fullmatch(text)
    codes = tuple(code.strip() for code in match[1].split(",") if code.strip()) if match else ()
    unknown = next((c for c in codes if not (c in rules or c in FORMER_CODES or c == "ALL")), None)
    if not match or not codes or unknown:
        message = f"unknown rule '{unknown}'" if unknown else f"the comment 'kbot: {text}' cannot be parsed"
        hint = near_rules(unknown) if unknown else ""
        hint = hint or "write <!-- kbot: ignore[CODE] reason -->"
        return Diagnostic("K002", Severity.WARNING, message, Origin(span), hint)
    first = span.line
    source = span.source
    last = source.line_column(span.end)[0]
    before = source.line(first)[: span.column - 1].strip()
    after = source.line(last)[source.line_column(span.end)[1] - 1 :].strip()
    lines = [*range(first, last + 1)]
    if not before and not after and last in next_lines:
        lines.append(next_lines[last])
    return Suppression(span, lines, codes, set())


def _next_lines(source: Source) -> dict[int, int]:
    """For each line, the next line that is not only a comment."""
    found: dict[int, int] = {}
    following = 0
    for number in range(source.line_count, 0, -1):
        if following:
            found[number] = following
        text = source.line(number).strip()
        if text and not (text.startswith("<!--") and text.endswith("-->")):
            following = number
    return found


def _unused(comment: Suppression) -> Diagnostic | None:
    unused = [code for code in comment.codes if code not in comment.used]
    if not unused:
        return None
    message = f"the comment suppresses nothing: no finding {' or '.join(unused)} here"
    fix = None
    if len(unused) == len(comment.codes):
        fix = Fix("remove the comment", (Edit(with_line(comment.span), ""),), safe=True)
    return Diagnostic("K001", Severity.INFO, message, Origin(comment.span), fix=fix)
