"""The results of one battery with many robots as a CSV file, one row for each robot."""

from __future__ import annotations

import csv
import io
from collections.abc import Iterable, Sequence

from kbot.text.render import encodable
from kbot.trials.results import TrialResult

PASS = "pass"
_COLUMNS = ("path", "robot", "passed", "failed", "score")
"""The first columns. One for each scenario follows."""
MARK = ",".join(_COLUMNS)
"""The beginning of every table, by which KBot knows that it may overwrite the file."""
_FORMULA = ("=", "+", "-", "@", "\t", "\r")
"""First characters that make a spreadsheet evaluate a cell. A student may choose names and error texts."""


def grades(trials: Iterable[tuple[str, TrialResult]]) -> str:
    """CSV with a row for each robot: its path and name, how many trials passed and failed, the share that
    passed, and then `pass` or the reason for each scenario.

    `trials` are results with the paths of their robots as they were typed.
    """
    rows: dict[str, list[TrialResult]] = {}
    for path, result in trials:
        rows.setdefault(path, []).append(result)
    columns = list(dict.fromkeys(result.title for results in rows.values() for result in results))
    text = io.StringIO()
    table = csv.writer(text, lineterminator="\n")
    table.writerow([*_COLUMNS, *map(_cell, columns)])
    for path, results in rows.items():
        passed = sum(result.passed for result in results)
        table.writerow(
            [
                _cell(path),
                _cell(next((result.robot for result in results if result.robot), "")),
                passed,
                len(results) - passed,
                f"{passed / len(results):.2f}",
                *(_cell(_entry(results, column)) for column in columns),
            ]
        )
    return encodable(text.getvalue())


def _entry(results: Sequence[TrialResult], title: str) -> str:
    result = next((each for each in results if each.title == title), None)
    return "" if result is None else result.reason or PASS


def _cell(text: str) -> str:
    return f"'{text}" if text.startswith(_FORMULA) else text
