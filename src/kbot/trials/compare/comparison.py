"""The result of comparing two robots: which measures and settings changed, and which edits caused it."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass

from kbot.text.columns import aligned
from kbot.trials.compare.causes import Cause, Change
from kbot.trials.compare.declarations import DeclaredDifference, Setting
from kbot.trials.compare.edits import Edit
from kbot.trials.compare.significance import SCANS, Difference

SCHEMA = 1
"""Version of the JSON of `kbot compare`."""


@dataclass(frozen=True, slots=True)
class Comparison:
    """How robot `after` behaves compared with robot `before`.

    differences     all measures of all scenarios; none if the descriptions are equivalent
    causes          strongest first
    declared        the settings of sensors, topics and frames that differ
    without_effect  edits on which a simulation may depend, but that change no measure and no setting
    """

    before: str
    after: str
    differences: tuple[Difference, ...] = ()
    causes: tuple[Cause, ...] = ()
    declared: tuple[DeclaredDifference, ...] = ()
    without_effect: tuple[Change, ...] = ()

    @property
    def significant(self) -> tuple[Difference, ...]:
        """The differences that count, strongest first."""
        return tuple(sorted((d for d in self.differences if d.is_significant), key=lambda d: -d.size))

    @property
    def is_changed(self) -> bool:
        return bool(self.declared) or any(difference.is_significant for difference in self.differences)

    @property
    def scans_not_measured(self) -> tuple[str, ...]:
        """The lidars that both robots have, but whose scans no scenario compares."""
        values: dict[str, list[float]] = {}
        for difference in self.differences:
            family, _, lidar = difference.measure.partition("/")
            if lidar and family == SCANS[0][0]:
                values.setdefault(lidar, []).append(difference.after)
        return tuple(lidar for lidar, found in values.items() if all(map(math.isnan, found)))

    def to_json(self) -> dict[str, object]:
        """As `kbot compare --json` prints it. The edits of an interaction are separate causes."""
        return {
            "schema": SCHEMA,
            "changed": self.is_changed,
            "measures": [difference.to_json() for difference in self.differences],
            "declared": [difference.to_json() for difference in self.declared],
            "causes": [
                {**_edit_to_json(edit), "measures": _measures(cause), "declared": _settings(cause)}
                for cause in self.causes
                for edit in _lines(cause.changes)
            ],
            "without_effect": [_edit_to_json(edit) for edit in _lines(self.without_effect)],
        }


NO_RESULT: dict[str, object] = {
    "schema": SCHEMA,
    "changed": False,
    "measures": [],
    "declared": [],
    "causes": [],
    "without_effect": [],
}
"""The JSON of a comparison that could not be made."""
MOST_ROWS = 12
"""Differences in each table of the report. All are in the JSON."""
MOST_EDITS = 10
"""Edits of a cause in the report. All are in the JSON."""


def to_text(comparison: Comparison, *, all_rows: bool = False) -> str:
    """The comparison for a terminal."""
    if not comparison.is_changed:
        no_change = f"{_no_change(comparison)}: {comparison.after} behaves as {comparison.before}"
        return "\n".join([no_change + _measured(comparison), *_edits_without_effect(comparison)])
    significant = comparison.significant
    rows = significant if all_rows else _rows(significant)
    lines = [f"{len(significant)} of {len(comparison.differences)} measures changed"]
    if rows:
        head = ("scenario", "measure", "before", "after", "change")
        lines += ["", *aligned([head, *map(_row, rows)], left=(0, 1))]
    if len(rows) < len(significant):
        lines.append(f"… {len(significant) - len(rows)} more (-v)")
    declared = comparison.declared if all_rows else comparison.declared[:MOST_ROWS]
    if declared:
        titles = ("declared", "setting", "before", "after")
        lines += ["", *aligned([titles, *map(_declared_row, declared)], left=(0, 1))]
    if len(declared) < len(comparison.declared):
        lines.append(f"… {len(comparison.declared) - len(declared)} more (-v)")
    if comparison.scans_not_measured:
        lines += ["", _scans_not_measured(comparison)]
    for number, cause in enumerate(comparison.causes, 1):
        lines.append("")
        together = " (these edits act only together)" if cause.is_interaction else ""
        lines.append(f"cause {number}{together}: changes {_names(cause)}")
        lines += _edits(cause.changes)
    if not comparison.causes:
        lines += ["", "no edit of the sources explains the change"]
    return "\n".join([*lines, *_edits_without_effect(comparison)])


def to_markdown(comparison: Comparison) -> str:
    """The comparison for a pull request."""
    title = f"`{comparison.after}` compared with `{comparison.before}`"
    if not comparison.is_changed:
        lines = ["### ✅ The robot behaves as before", "", title + _measured(comparison)]
        return "\n".join([*lines, *_markdown_without_effect(comparison)]) + "\n"
    significant = comparison.significant
    counts = [f"{len(significant)} measures"] if significant else []
    counts += [f"{len(comparison.declared)} declared settings"] if comparison.declared else []
    lines = [f"### ⚠️ The robot behaves differently: {' and '.join(counts)} changed", "", title]
    if significant:
        lines += [
            "",
            "| scenario | measure | before | after | change |",
            "| --- | --- | ---: | ---: | ---: |",
            *(_markdown_row(_row(d)) for d in _rows(significant)),
        ]
    if len(significant) > MOST_ROWS:
        lines += ["", f"… and {len(significant) - MOST_ROWS} more."]
    if comparison.declared:
        lines += [
            "",
            "| declared | setting | before | after |",
            "| --- | --- | ---: | ---: |",
            *(_markdown_row(_declared_row(d)) for d in comparison.declared[:MOST_ROWS]),
        ]
    if len(comparison.declared) > MOST_ROWS:
        lines += ["", f"… and {len(comparison.declared) - MOST_ROWS} more."]
    if comparison.scans_not_measured:
        lines += ["", _escaped(_scans_not_measured(comparison))]
    for number, cause in enumerate(comparison.causes, 1):
        together = " (these edits act only together)" if cause.is_interaction else ""
        lines += ["", f"**Cause {number}**{together}: changes {_escaped(_names(cause))}"]
        lines += _markdown_edits(cause.changes)
    return "\n".join([*lines, *_markdown_without_effect(comparison)]) + "\n"


def _no_change(comparison: Comparison) -> str:
    return "no measured change" if comparison.without_effect else "no change"


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
    before, after = (
        "-" if math.isnan(value) else f"{value:.4g}{unit}" for value in (difference.before, difference.after)
    )
    change = difference.after - difference.before
    has_share = abs(difference.before) > difference.threshold
    share = f" ({100.0 * change / abs(difference.before):+.1f} %)" if has_share else ""
    shown = "-" if math.isnan(change) else f"{change:+.3g}{unit}{share}"
    return difference.scenario, difference.measure, before, after, shown


def _declared_row(difference: DeclaredDifference) -> tuple[str, ...]:
    def text(value: Setting | None) -> str:
        plain = f"{value + 0.0:.4g}" if isinstance(value, float) else value  # + 0.0 turns -0.0 into 0.0
        return f"{plain} {difference.unit}".rstrip() if plain else "-"

    return difference.part, difference.setting, text(difference.before), text(difference.after)


def _scans_not_measured(comparison: Comparison) -> str:
    names = ", ".join(f"'{name}'" for name in comparison.scans_not_measured)
    return (
        f"not measured: the scans of {names}. They need a scenario with objects in range, and "
        "two sensors whose beams have the same directions"
    )


def _markdown_row(cells: Iterable[str]) -> str:
    return f"| {' | '.join(map(_escaped, cells))} |"


_WITHOUT_EFFECT = "edits that change no measure and no declared setting"


def _edits_without_effect(comparison: Comparison) -> list[str]:
    changes = comparison.without_effect
    return ["", f"{_WITHOUT_EFFECT}:", *_edits(changes)] if changes else []


def _markdown_without_effect(comparison: Comparison) -> list[str]:
    changes = comparison.without_effect
    return ["", f"{_WITHOUT_EFFECT.capitalize()}:", *_markdown_edits(changes)] if changes else []


def _edits(changes: Sequence[Change]) -> list[str]:
    """The edits for a terminal."""
    shown, more = _shown_lines(changes)
    lines = [line for edit in shown for line in (f"  {_place(edit)}", *_diff(edit, "    "))]
    return [*lines, f"  {more}"] if more else lines


def _markdown_edits(changes: Sequence[Change]) -> list[str]:
    shown, more = _shown_lines(changes)
    lines: list[str] = []
    for edit in shown:
        fence = "`" * (1 + max((2, *(len(run) for run in _backticks(edit.before + edit.after)))))
        lines += ["", f"`{_place(edit)}`", f"{fence}diff", *_diff(edit, ""), fence]
    return [*lines, "", more] if more else lines


def _lines(changes: Sequence[Change]) -> list[Edit]:
    return [edit for change in changes for edit in change.lines]


def _shown_lines(changes: Sequence[Change]) -> tuple[list[Edit], str]:
    """The edits of some changes that a report shows, and how many more there are."""
    lines = _lines(changes)
    more = len(lines) - MOST_EDITS
    return lines[:MOST_EDITS], f"… {more} more edits" if more > 0 else ""


def _edit_to_json(edit: Edit) -> dict[str, object]:
    return {
        "file": edit.file,
        "line": edit.line,
        "column": edit.column,
        "before": edit.before,
        "after": edit.after,
    }


def _measures(cause: Cause) -> list[str]:
    """The names of the measures that a cause changes, the strongest effect first."""
    strongest = sorted(cause.effects.values(), key=lambda effect: -effect.size)
    return list(dict.fromkeys(each.measure for each in strongest if isinstance(each, Difference)))


def _settings(cause: Cause) -> list[str]:
    """The declared settings that a cause changes."""
    return [each.label for each in cause.effects.values() if isinstance(each, DeclaredDifference)]


def _names(cause: Cause) -> str:
    strongest = sorted(cause.effects.values(), key=lambda effect: -effect.size)
    names = [effect.label for effect in strongest]
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
