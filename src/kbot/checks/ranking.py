"""Ranks findings for a reader: errors first, causes before consequences, the rest as a summary."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Sequence

from kbot.checks.registry import all_rules
from kbot.text import Diagnostic, Severity
from kbot.text.render import place

_MOST_LINES = 10
"""Lines of a summary: they fit below an error on any screen."""
_SEVERITIES = list(Severity)
_STAGES = ("F", "P", "X", "S", "U0")
"""Families of codes in the order in which a description is read: each may cause errors of the next."""

_NOTES = frozenset({"J113", "S104", "U202"})
"""Rules about parts without an effect. There are often dozens, which hide the other findings."""


def is_note(diagnostic: Diagnostic) -> bool:
    """Whether a finding is folded in the terminal. A misspelt attribute (U202) is a warning, and is not."""
    return diagnostic.code in _NOTES and diagnostic.severity is Severity.INFO


def folded(notes: Sequence[Diagnostic]) -> str:
    """One line for all notes: how many each rule has."""
    numbers = Counter(diagnostic.code for diagnostic in notes).most_common()
    rules = all_rules()
    parts = [f"{number} {code} {rules[code].name}" for code, number in numbers]
    return f"{len(notes)} note{'s' * (len(notes) > 1)}: {', '.join(parts)}; -v shows them"


def ranked(found: Iterable[Diagnostic]) -> list[Diagnostic]:
    """Errors, warnings, infos. Errors of an early stage come first, each stage in the given order."""
    return sorted(found, key=lambda d: (_SEVERITIES.index(d.severity), _stage(d) if d.is_error else 0))


def _stage(diagnostic: Diagnostic) -> int:
    code = diagnostic.code
    return next((i for i, family in enumerate(_STAGES) if code.startswith(family)), len(_STAGES))


def summary(found: Sequence[Diagnostic]) -> list[str]:
    """One line per rule, the most serious and frequent first: number, severity, code, name, first place."""
    groups: dict[str, list[Diagnostic]] = {}
    for diagnostic in ranked(found):
        groups.setdefault(diagnostic.code, []).append(diagnostic)
    rules = sorted(groups.values(), key=lambda group: (_SEVERITIES.index(group[0].severity), -len(group)))
    shown = rules if len(rules) <= _MOST_LINES else rules[: _MOST_LINES - 1]
    rows = [_row(group) for group in shown]
    widths = [max((len(row[column]) for row in rows), default=0) for column in range(3)]
    lines = [
        f"{count:>{widths[0]}} {severity:<{widths[1]}} {rule:<{widths[2]}}  {where}".rstrip()
        for count, severity, rule, where in rows
    ]
    if len(shown) < len(rules):
        lines.append(f"… and {len(rules) - len(shown)} more rules")
    return lines


def _row(group: Sequence[Diagnostic]) -> tuple[str, str, str, str]:
    first, number = group[0], len(group)
    rule = all_rules().get(first.code)
    plural = "s" * (number > 1 and first.severity is not Severity.INFO)
    name = f"{first.code} {rule.name if rule else ''}".rstrip()
    return (
        str(number),
        f"{first.severity}{plural}",
        name,
        f"first at {place(first.origin)}" if first.origin else "",
    )
