"""Comments `<!-- kbot: ignore[CODE] why -->` on a line or above it, and those that suppress nothing."""

from __future__ import annotations

import re
from collections import defaultdict
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
    lines: Sequence[int]
    codes: tuple[str, ...]
    used: set[str]

    def covers(self, diagnostic: Diagnostic) -> bool:
        """Whether it names the code of a finding that is on one of its lines."""
        code = next((c for c in self.codes if c in (diagnostic.code, "ALL")), None)
        if code is None:
            return False
        self.used.add(code)
        return True


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
        next_lines = _next_lines(source)
        for match in _COMMENT.finditer(source.data):
            if not match[2]:
                break  # it is not closed: the file is not well-formed, and reported for that
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
        # every comment is asked, so that each learns whether it is used
        covered = [c.covers(diagnostic) for c in near]
        kept += [] if any(covered) else [diagnostic]
    kept += [d for c in comments if (d := _unused(c))]
    return kept


def _read(
    span: Span, text: str, rules: Mapping[str, Rule], next_lines: Mapping[int, int]
) -> Suppression | Diagnostic:
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
    lines = [*range(first, last + 1)]
    if not before and not after and last in next_lines:
        lines.append(next_lines[last])
    return Suppression(span, lines, codes, set())


def _next_lines(source: Source) -> dict[int, int]:
    """For each line the next one that has anything but comments on it, where there is one."""
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
    message = f"the comment suppresses nothing: there is no {', '.join(unused)} here"
    fix = None
    if len(unused) == len(comment.codes):
        fix = Fix("remove the comment", (Edit(with_line(comment.span), ""),), safe=True)
    return Diagnostic("K001", Severity.INFO, message, Origin(comment.span), fix=fix)
