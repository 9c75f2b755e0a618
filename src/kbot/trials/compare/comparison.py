"""The result of comparing two robots: which measures changed, and which edits caused it."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

from kbot.text.columns import aligned
from kbot.trials.compare.causes import Cause
from kbot.trials.compare.edits import Edit
from kbot.trials.compare.significance import Difference

SCHEMA = 1
"""Version of the JSON of `kbot compare`."""


@dataclass(frozen=True, slots=True)
class Comparison:
    """How robot `after` behaves compared with robot `before`.

    differences  all measures of all scenarios; none if the descriptions are equivalent
    causes       strongest first
    """

    before: str
    after: str
    differences: tuple[Difference, ...] = ()
    causes: tuple[Cause, ...] = ()

    @property
    def significant(self) -> tuple[Difference, ...]:
        """The differences that count, strongest first."""
        return tuple(sorted((d for d in self.differences if d.is_significant), key=lambda d: -d.size))

    @property
    def is_changed(self) -> bool:
        return any(difference.is_significant for difference in self.differences)

    def to_json(self) -> dict[str, object]:
        """As `kbot compare --json` prints it. The edits of an interaction are separate causes."""
        return {
            "schema": SCHEMA,
            "changed": self.is_changed,
            "measures": [difference.to_json() for difference in self.differences],
            "causes": [
                {
                    "file": edit.file,
                    "line": edit.line,
                    "column": edit.column,
                    "before": edit.before,
                    "after": edit.after,
                    "measures": _measures(cause),
                }
                for cause in self.causes
                for edit in _lines(cause)
            ],
        }


NO_RESULT: dict[str, object] = {"schema": SCHEMA, "changed": False, "measures": [], "causes": []}
"""The JSON of a comparison that could not be made."""
MOST_ROWS = 12
"""Differences in the report. All are in the JSON."""
MOST_EDITS = 10
"""Edits of a cause in the report. All are in the JSON."""


def to_text(comparison: Comparison, *, all_rows: bool = False) -> str:
    """The comparison for a terminal."""
    if not comparison.is_changed:
        return f"no change: {comparison.after} behaves as {comparison.before}" + _measured(comparison)
    significant = comparison.significant
    rows = significant if all_rows else _rows(significant)
    lines = [f"{len(significant)} of {len(comparison.differences)} measures changed", ""]
    head = ("scenario", "measure", "before", "after", "change")
    lines += aligned([head, *map(_row, rows)], left=(0, 1))
    if len(rows) < len(significant):
        lines.append(f"… {len(significant) - len(rows)} more (-v)")
    for number, cause in enumerate(comparison.causes, 1):
        lines.append("")
        together = " (these edits act only together)" if cause.is_interaction else ""
        lines.append(f"cause {number}{together}: changes {_names(cause)}")
        shown, more = _shown_lines(cause)
        for edit in shown:
            lines += [f"  {_place(edit)}", *_diff(edit, "    ")]
        lines += [f"  {more}"] if more else []
    if not comparison.causes:
        lines += ["", "no edit of the sources explains the change"]
    return "\n".join(lines)


def to_markdown(comparison: Comparison) -> str:
    """The comparison for a pull request."""
    title = f"`{comparison.after}` compared with `{comparison.before}`"
    if not comparison.is_changed:
        return f"### ✅ The robot behaves as before\n\n{title}{_measured(comparison)}\n"
    significant = comparison.significant
    lines = [
        f"### ⚠️ The robot behaves differently: {len(significant)} measures changed",
        "",
        title,
        "",
        "| scenario | measure | before | after | change |",
        "| --- | --- | ---: | ---: | ---: |",
        *(f"| {' | '.join(_escaped(cell) for cell in _row(d))} |" for d in _rows(significant)),
    ]
    if len(significant) > MOST_ROWS:
        lines += ["", f"… and {len(significant) - MOST_ROWS} more."]
    for number, cause in enumerate(comparison.causes, 1):
        together = " (these edits act only together)" if cause.is_interaction else ""
        lines += ["", f"**Cause {number}**{together}: changes {_escaped(_names(cause))}"]
        shown, more = _shown_lines(cause)
        for edit in shown:
            fence = "`" * (1 + max((2, *(len(run) for run in _backticks(edit.before + edit.after)))))
            lines += ["", f"`{_place(edit)}`", f"{fence}diff", *_diff(edit, ""), fence]
        lines += ["", more] if more else []
    return "\n".join(lines) + "\n"


def _measured(comparison: Comparison) -> str:
    if not comparison.differences:
        return ", because their descriptions are equivalent"
    scenarios = len({difference.scenario for difference in comparison.differences})
    word = "scenario" if scenarios == 1 else "scenarios"
    return f" ({len(comparison.differences)} measures of {scenarios} {word})"


def _rows(significant: Sequence[Difference]) -> list[Difference]:
    """The rows of a report: the strongest difference of each scenario, then the second of each, and so on."""
    ranks: Counter[str] = Counter()
    ranked: list[tuple[int, Difference]] = []
    for difference in significant:
        ranked.append((ranks[difference.scenario], difference))
        ranks[difference.scenario] += 1
    ranked.sort(key=lambda item: item[0])
    return [difference for _, difference in ranked[:MOST_ROWS]]


def _row(difference: Difference) -> tuple[str, ...]:
    unit = f" {difference.unit}" if difference.unit else ""
    before, after = f"{difference.before:.4g}{unit}", f"{difference.after:.4g}{unit}"
    change = difference.after - difference.before
    has_share = abs(difference.before) > difference.threshold
    share = f" ({100.0 * change / abs(difference.before):+.1f} %)" if has_share else ""
    return difference.scenario, difference.measure, before, after, f"{change:+.3g}{unit}{share}"


def _lines(cause: Cause) -> list[Edit]:
    return [edit for change in cause.changes for edit in change.lines]


def _shown_lines(cause: Cause) -> tuple[list[Edit], str]:
    """The edits of a cause that a report shows, and how many more there are."""
    lines = _lines(cause)
    more = len(lines) - MOST_EDITS
    return lines[:MOST_EDITS], f"… {more} more edits" if more > 0 else ""


def _measures(cause: Cause) -> list[str]:
    """The names of the measures that a cause changes, the strongest effect first."""
    strongest = sorted(cause.effects.values(), key=lambda effect: -effect.size)
    return list(dict.fromkeys(effect.measure for effect in strongest))


def _names(cause: Cause) -> str:
    strongest = sorted(cause.effects.values(), key=lambda effect: -effect.size)
    names = [f"{effect.scenario} {effect.measure}" for effect in strongest]
    return ", ".join(names[:4]) + (f" and {len(names) - 4} more" if len(names) > 4 else "")


def _diff(edit: Edit, indent: str) -> list[str]:
    removed = [f"{indent}- {line}" for line in edit.before.splitlines()]
    return removed + [f"{indent}+ {line}" for line in edit.after.splitlines()]


def _place(edit: Edit) -> str:
    return f"{edit.file}:{edit.line}:{edit.column}"


def _escaped(text: str) -> str:
    return text.replace("\\", "\\\\").replace("|", "\\|").replace("<", "&lt;")


def _backticks(text: str) -> Iterator[str]:
    """The runs of backticks in a text."""
    run = ""
    for character in text + " ":
        if character == "`":
            run += character
        elif run:
            yield run
            run = ""
