"""The results of trials as a table for the terminal."""

from __future__ import annotations

from collections.abc import Sequence

from kbot.text import Diagnostic
from kbot.text.render import place, printable
from kbot.trials.results import MeasureResult, TrialResult

_GREEN, _RED = "32", "1;31"
_MOST_FINDINGS = 3
"""Findings of a failed trial. `--html` shows more, with excerpts of the sources."""


def table(results: Sequence[TrialResult], *, color: bool = False) -> str:
    """One line for each trial: whether it passed, its name and seed, the first measure, and why it failed."""
    rows = [_Row(result, color) for result in results]
    width = max((len(row.title) for row in rows), default=0)
    number_width = max((len(row.number) for row in rows), default=0)
    return "".join(
        row.text(width, number_width, is_repeated=index > 0 and row.repeats(rows[index - 1]))
        for index, row in enumerate(rows)
    )


def summary(results: Sequence[TrialResult], seconds: float, *, not_run: int = 0, color: bool = False) -> str:
    """The last line: `12 passed, 1 failed in 8.2 s`. `not_run`: trials before which KBot was interrupted."""
    passed = sum(result.passed for result in results)
    failed = len(results) - passed
    parts = [f"{passed} passed"] if passed or not failed else []
    parts += [f"{failed} failed"] if failed else []
    parts += [f"interrupted before {not_run} of {len(results) + not_run} trials"] if not_run else []
    tone = _RED if failed or not_run else _GREEN
    return _paint(f"{', '.join(parts)} in {seconds:.1f} s", tone, color)


class _Row:
    def __init__(self, result: TrialResult, color: bool) -> None:
        self.result, self.color = result, color
        self.title = printable(result.title)
        self.number = _number(result.measures) if result.passed and result.measures else ""

    def repeats(self, above: _Row) -> bool:
        """Whether both have the same error, such as a robot that no scenario can load."""
        return bool(self.result.error) and self.result.error == above.result.error

    def text(self, width: int, number_width: int, *, is_repeated: bool) -> str:
        result = self.result
        mark = _paint("✓", _GREEN, self.color) if result.passed else _paint("✗", _RED, self.color)
        reason = "the same error" if is_repeated else printable(result.reason or "")
        more = reason if not result.passed else self.number.ljust(number_width)
        note = "" if result.is_deterministic else "  (ran in real time: not deterministic)"
        line = f"{mark} {self.title:<{width}}  {more}{note}".rstrip() + "\n"
        if result.recording and not result.passed:
            line += f"    {replay_command(result)}\n"
        if not result.passed:
            line += "".join(f"    {_finding(found)}\n" for found in result.findings[:_MOST_FINDINGS])
        return line


def replay_command(result: TrialResult) -> str:
    """The command that shows the recording of a failed trial, at the moment of its failure."""
    import shlex  # rarely needed: start-up time

    at = "" if result.failed_at is None else f" --at {max(0.0, result.failed_at - 1.0):.1f}"
    return f"kbot view {shlex.quote(result.recording)}{at}"


def _finding(found: Diagnostic) -> str:
    """What KBot found about the run, with its place in the sources as the user names them."""
    where = f"{place(found.origin)}: " if found.origin else ""
    return printable(f"{where}{found.severity}: {found.message} [{found.code}]")


def _number(measures: Sequence[MeasureResult]) -> str:
    """The first measure that is not a count, with up to four digits after the point: 0.1 mm is exact."""
    measure = next((each for each in measures if each.unit), measures[0])
    value = round(measure.value, 4) + 0.0  # turns -0.0 into 0.0
    unit = f" {measure.unit}" if measure.unit else ""
    return f"{measure.name} {value:.10g}{unit}"


def _paint(text: str, tone: str, color: bool) -> str:
    return f"\x1b[{tone}m{text}\x1b[0m" if color else text
