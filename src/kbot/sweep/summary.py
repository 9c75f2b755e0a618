"""The text of a sweep for the terminal: the best designs, and why runs failed."""

from __future__ import annotations

import re
from collections import Counter

from kbot.sweep.results import Results
from kbot.text.columns import aligned
from kbot.text.render import printable
from kbot.trials.measures import find_measure, is_measure
from kbot.trials.results import with_unit

MOST_SHOWN = 10
"""Designs and reasons that are printed. The table has all of them."""
_NUMBER = re.compile(r"-?\d+(?:\.\d+)?(?:e[+-]?\d+)?")
"""Reasons that differ only in numbers are printed once."""


def summary(results: Results, seconds: float) -> str:
    """The best designs, the most frequent reasons of failures, the counts, and the file of the table."""
    reasons: Counter[str] = Counter()
    examples: dict[str, str] = {}
    for reason, count in results.reasons.items():
        kind = _NUMBER.sub("", reason)
        reasons[kind] += count
        examples.setdefault(kind, reason)
    lines = _best(results)
    for kind, count in reasons.most_common(MOST_SHOWN):
        similar = " (and similar)" if count > 1 else ""
        lines.append(printable(f"{count} failed: {examples[kind]}{similar}"))
    if len(reasons) > MOST_SHOWN:
        shown = sum(count for _, count in reasons.most_common(MOST_SHOWN))
        lines.append(f"{results.failed - shown} failed for other reasons")
    missing = f", {results.missing} missing" if results.missing else ""
    counts = f"{results.passed} passed, {results.failed} failed{missing}"
    lines.append(f"{counts} in {seconds:.1f} s: {results.table}")
    return "\n".join(lines)


def _best(results: Results) -> list[str]:
    objectives, best = results.plan.objectives, results.best
    if not objectives:
        return []
    so_far = f" so far, after {results.done} of {results.plan.runs} runs" if results.missing else ""
    if not best:
        return [f"no design passed all its runs and has a value of each objective{so_far}"]
    goals = ", ".join(f"{'highest' if each.is_maximum else 'lowest'} {each.name}" for each in objectives)
    title = goals if len(objectives) == 1 else f"Pareto front of {goals}, {_designs(len(best))}"
    lines = [f"{title}{so_far}:"]
    values = best[0].values
    names = ["design", *values, *(each.name for each in objectives if each.name not in values)]
    rows = [names]
    for design in best[:MOST_SHOWN]:
        shown = {name: _shown(name, value) for name, value in design.objectives.items()}
        shown |= {name: str(value) for name, value in design.values.items()}
        rows.append([str(design.number), *(shown[name] for name in names[1:])])
    lines += [f"  {line}" for line in aligned(rows)]
    if len(best) > MOST_SHOWN:
        lines.append(f"  … and {len(best) - MOST_SHOWN} more")
    return lines


def _designs(count: int) -> str:
    return f"{count} design{'s' if count > 1 else ''}"


def _shown(name: str, value: float) -> str:
    return with_unit(value, find_measure(name).unit if is_measure(name) else "")
