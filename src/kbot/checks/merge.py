"""Merges findings in macros: a fault of a macro is reported once, a fault of a single call at that call."""

from __future__ import annotations

import re
from collections import defaultdict
from collections.abc import Iterable, Mapping, Set
from dataclasses import replace
from itertools import pairwise

from kbot.checks.context import Context
from kbot.checks.edits import with_line
from kbot.checks.spelling import with_fix
from kbot.text import Call, Diagnostic, Element, Fix, Origin, Related, Span

_SHOWN = 8
"""Other calls that a merged finding lists; the rest are counted in its hint."""

_REPORTED_ONCE = "X1"
"""The first letters of errors of expansion. Each is reported only for the first call that has it, so the
other calls have no such finding. It stays at its line in the macro."""
_BARE = re.compile(r"\s*\$\{\s*(\w+)\s*\}\s*")
Parameters = Mapping[str, frozenset[str]]


def merge_findings(found: Iterable[Diagnostic], context: Context) -> list[Diagnostic]:
    """Merge findings with the same code at the same place into one.

    A value that a macro only passes on (`${m}`) belongs to the caller: the finding moves to the call.

    If every expansion of the place has the fault, it is a fault of the macro, and its calls are listed as
    related places. If only some expansions have it, those calls are at fault. The finding then moves to the
    innermost call that no faultless expansion shares, and keeps its fix only if that edits this call alone.
    """
    groups: dict[tuple[str, str, int, int], list[Diagnostic]] = defaultdict(list)
    result: list[Diagnostic] = []
    for given in found:
        diagnostic = with_fix(_at_value(given, context), context)
        origin = diagnostic.origin
        if origin is None or diagnostic.code.startswith(_REPORTED_ONCE) or not _macros(origin.call):
            result.append(diagnostic)
        else:
            span = origin.span
            groups[diagnostic.code, span.file, span.start, span.end].append(diagnostic)
    if groups:
        copies = _Copies(context, groups.values())
        moved: dict[tuple[str, str, int], list[Diagnostic]] = defaultdict(list)
        for group in groups.values():
            for diagnostic in copies.placed(group):
                span = diagnostic.origin.span  # type: ignore[union-attr]  # placed ones have an origin
                moved[diagnostic.code, span.file, span.start].append(diagnostic)
        result += [_merged(group) for group in moved.values()]
    return list(dict.fromkeys(result))


def _at_value(diagnostic: Diagnostic, context: Context) -> Diagnostic:
    """Move a finding to the call that passed the value, if the macro only passes it on.

    It keeps its fix only if that edits this call alone.
    """
    origin, parameters, caller = diagnostic.origin, context.parameters, None
    while origin is not None and origin.call is not None and origin.call.kind == "macro":
        call = origin.call
        bare = _BARE.fullmatch(origin.span.text)
        if not bare or bare[1] not in parameters.get(call.name.removeprefix("xacro:"), ()):
            break
        value = re.compile(rb"\b" + bare[1].encode() + rb"""\s*=\s*("[^"]*"|'[^']*')""")
        match = value.search(call.span.source.data, call.span.start, call.span.end)
        if not match:
            break
        span = Span(call.span.source, match.start(1) + 1, match.end(1) - 1)
        origin, caller = Origin(span, call.caller), context.call_at(call.span)
    if origin is diagnostic.origin or diagnostic.origin is None:
        return diagnostic
    made = Related("the value is used here", diagnostic.origin)
    fix = diagnostic.fix if _edits_only(diagnostic.fix, caller) else None
    return replace(diagnostic, origin=origin, related=(*diagnostic.related, made), fix=fix)


class _Copies:
    """The macro calls that made the copies of each element with a finding."""

    def __init__(self, context: Context, groups: Iterable[list[Diagnostic]]) -> None:
        self._context = context
        self._paths: dict[int, str] = {}
        spans = [g[0].origin.span for g in groups if g[0].origin]
        self._calls: dict[tuple[str, int], list[Call]] = {(s.file, _tag_at(s)): [] for s in spans}
        starts = {start for _, start in self._calls}
        for element in context.elements if context.document is not None else ():
            if element.start in starts and element.call is not None:
                calls = self._calls.get((element.source.path, element.start))
                if calls is not None:
                    calls.append(element.call)

    def placed(self, group: list[Diagnostic]) -> list[Diagnostic]:
        """The findings of one place: unchanged if all copies have them, else moved to their calls."""
        by_calls = {self._path(d.origin.call): d for d in group if d.origin}
        span = group[0].origin.span if group[0].origin else None
        calls = self._calls[span.file, _tag_at(span)] if span else []
        others = [c for c in calls if self._path(c) not in by_calls]
        if not others:
            return list(by_calls.values())
        faultless = {(level, call.span) for c in others for level, call in enumerate(_macros(c))}
        return [_at_call(d, faultless, self._context) for d in by_calls.values()]

    def _path(self, call: Call | None) -> str:
        """The macro calls that lead to an element as text, cached because many elements share them."""
        path = self._paths.get(id(call))
        if path is None:
            spans = (c.span for c in _macros(call))
            path = " ".join(f"{span.start}:{span.end}:{span.file}" for span in spans)
            self._paths[id(call)] = path
        return path


def _tag_at(span: Span) -> int:
    """The offset of the start tag that contains or precedes a span."""
    data = span.source.data
    at = data.rfind(b"<", 0, span.start + 1)
    while at > 0 and data[at + 1 : at + 2] in (b"/", b"!"):
        at = data.rfind(b"<", 0, at)
    return at


def _macros(call: Call | None) -> list[Call]:
    return [c for c in call.chain() if c.kind == "macro"] if call else []


def _at_call(diagnostic: Diagnostic, faultless: Set[tuple[int, Span]], context: Context) -> Diagnostic:
    """Move a finding to the innermost call that no faultless copy shares."""
    origin = diagnostic.origin
    if origin is None:
        return diagnostic
    for level, call in enumerate(_macros(origin.call)):
        if (level, call.span) not in faultless:
            made = Related(f"made here, in macro '{call.name}'", Origin(origin.span, origin.call))
            related = (made, *diagnostic.related)
            fix = diagnostic.fix if _edits_only(diagnostic.fix, context.call_at(call.span)) else None
            return replace(diagnostic, origin=Origin(call.span, call.caller), related=related, fix=fix)
    return diagnostic


def _edits_only(fix: Fix | None, element: Element | None) -> bool:
    """Whether all edits of a fix are inside an element, or remove its line."""
    if fix is None or element is None:
        return False
    line = with_line(element.whole)
    spans = [edit.span for edit in fix.edits]
    return all(s.file == line.file and line.start <= s.start and s.end <= line.end for s in spans)


def _joined(fixes: list[Fix | None]) -> Fix | None:
    """Join the fixes of several calls into one. None if a call has no fix or the fixes contradict each
    other."""
    there = [fix for fix in fixes if fix is not None]
    if len(there) < len(fixes) or len({(fix.title, fix.safe) for fix in there}) > 1:
        return None
    edits = sorted({edit for fix in there for edit in fix.edits}, key=lambda e: (e.span.file, e.span.start))
    if any(a.span.file == b.span.file and a.span.end >= b.span.start for a, b in pairwise(edits)):
        return None
    return Fix(there[0].title, tuple(edits), there[0].safe)


def _merged(group: list[Diagnostic]) -> Diagnostic:
    """Join the findings of one place in a macro into one, with the other calls as related places."""
    first = group[0]
    if len(group) == 1:
        return first
    if any(d.fix != first.fix for d in group):
        first = replace(first, fix=_joined([d.fix for d in group]))
    related = list(first.related)
    for other in group[1 : _SHOWN + 1]:
        calls = _macros(other.origin.call) if other.origin else []
        if calls:
            outer = calls[-1]
            related.append(Related(f"also: {other.message}", Origin(outer.span, outer.caller)))
    hint = first.hint
    if len(group) > _SHOWN + 1:
        hint = f"{hint}; " if hint else ""
        hint += f"and {len(group) - _SHOWN - 1} more calls"
    return replace(first, related=tuple(related), hint=hint)
