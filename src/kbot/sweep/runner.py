"""Runs a sweep in a folder, and finds the best designs of what has been run."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from itertools import groupby
from pathlib import Path
from typing import Any

from kbot.sweep.executor import Executor
from kbot.sweep.folder import TABLE, opened_folder
from kbot.sweep.inputs import changed_files
from kbot.sweep.journal import Journal, Row
from kbot.sweep.objectives import front
from kbot.sweep.plan import Plan
from kbot.sweep.search import search
from kbot.sweep.table import write_table
from kbot.text import KbotError
from kbot.text.notes import note

SCHEMA = 1
"""Version of the JSON of `kbot sweep`."""
NO_RESULT: Mapping[str, object] = {
    "schema": SCHEMA,
    "method": None,
    "runs": 0,
    "passed": 0,
    "failed": 0,
    "missing": 0,
    "table": None,
    "objectives": {},
    "best": [],
}
"""The JSON of a sweep that could not begin."""


@dataclass(frozen=True)
class Design:
    """One combination of values.

    number      its number
    values      by the name of the dimension
    objectives  by name, NaN if no run of it has a value
    rows        its runs
    """

    number: int
    values: Mapping[str, int | float | str]
    objectives: Mapping[str, float]
    rows: tuple[Row, ...]

    @property
    def passed(self) -> bool:
        return all(row.passed for row in self.rows)


class Sweep:
    """A sweep in a folder that is open."""

    def __init__(self, plan: Plan, journal: Journal, folder: Path) -> None:
        self.plan, self.journal, self.folder = plan, journal, folder

    @property
    def table(self) -> Path:
        """The file of the table."""
        return self.folder / TABLE

    @property
    def missing(self) -> int:
        """The number of runs that are not finished."""
        return self.plan.runs - self.journal.count

    @property
    def has_passed(self) -> bool:
        """Whether at least one run passed."""
        return any(row.passed for row in self.journal.rows())

    def run(self, executor: Executor, on_done: Callable[[], object] = lambda: None) -> None:
        """Execute the missing runs, and write the table. `on_done` is called after each run.

        Raises:
            KeyboardInterrupt: Ctrl-C. The table has the finished runs.
            KbotError: the disk is full, or the folder is not writable. The journal has the finished runs.
        """
        try:
            search(self.plan, self.journal, executor, on_done)
        except BaseException:
            with suppress(KbotError):  # the first error is reported
                self._write_table()
            raise
        self._write_table()

    def _write_table(self) -> None:
        """Write the table, and report files that changed after they were read for the plan."""
        changed = changed_files(self.plan.files)
        if changed:
            more = f" and {len(changed) - 1} more" if len(changed) > 1 else ""
            note(
                f"{changed[0]}{more} changed while the sweep ran: its rows may mix both versions. "
                "Run it again in another folder"
            )
        write_table(self.table, self.plan, self.journal)

    def designs(self) -> Iterator[Design]:
        """The designs of which all runs are finished, in order."""
        plan = self.plan
        names = [each.name for each in plan.space.dimensions]
        for number, found in groupby(self.journal.rows(), key=lambda row: row.design):
            rows = tuple(found)
            if len(rows) == len(plan.trials):
                objectives = {
                    objective.name: value
                    for objective, value in zip(plan.objectives, plan.objective_values(rows), strict=True)
                }
                yield Design(number, dict(zip(names, rows[0].values, strict=True)), objectives, rows)

    def best(self) -> list[Design]:
        """The best designs of which all runs passed: the Pareto front. Empty without an objective."""
        if not self.plan.objectives:
            return []
        values = {each.number: tuple(each.objectives.values()) for each in self.designs() if each.passed}
        chosen = front(self.plan.objectives, values)
        order = {number: index for index, number in enumerate(chosen)}
        return sorted(
            (each for each in self.designs() if each.number in order), key=lambda each: order[each.number]
        )

    def to_json(self) -> dict[str, Any]:
        """The object that `kbot sweep --json` prints."""
        passed = sum(row.passed for row in self.journal.rows())
        return {
            "schema": SCHEMA,
            "method": str(self.plan.method),
            "runs": self.plan.runs,
            "passed": passed,
            "failed": self.journal.count - passed,
            "missing": self.missing,
            "table": str(self.table),
            "objectives": {each.name: each.direction for each in self.plan.objectives},
            "best": [
                {"design": each.number, "values": each.values, "objectives": each.objectives}
                for each in self.best()
            ],
        }


@contextmanager
def opened_sweep(plan: Plan, out: str) -> Iterator[Sweep]:
    """Begin a sweep in the folder `out`, or continue it. Within the block, the folder is locked.

    Raises:
        KbotError: the folder has another sweep, another process uses it, or it cannot be written.
    """
    with opened_folder(out, plan) as journal:
        yield Sweep(plan, journal, Path(out))
