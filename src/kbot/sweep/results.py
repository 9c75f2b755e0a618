"""What the finished runs of a sweep show: how many passed, why others failed, and which designs are best."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping
from dataclasses import dataclass
from itertools import groupby
from pathlib import Path
from typing import Any

from kbot.sweep.journal import Journal
from kbot.sweep.objectives import front
from kbot.sweep.plan import Plan
from kbot.sweep.space import Value, Values

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


@dataclass(frozen=True, slots=True)
class Design:
    """One combination of values, all runs of which are finished.

    number      its number
    values      by the name of the dimension, in the order of the dimensions, with the units of the files
    objectives  by name: the mean over its runs, NaN if no run has a value. In the unit of the measure or
                dimension. The sign is not changed if it is maximised: lower is better by default, higher with
                `:max`
    failures    the reasons of its runs that failed
    """

    number: int
    values: Mapping[str, Value]
    objectives: Mapping[str, float]
    failures: tuple[str, ...]

    @property
    def passed(self) -> bool:
        return not self.failures


@dataclass(frozen=True, slots=True)
class Results:
    """The results of a sweep.

    plan     what the sweep runs
    table    the file of the table
    done     the number of finished runs
    reasons  how many runs failed, by reason, in the order of the runs
    designs  those of which all runs are finished, in order
    best     those of them that no other one beats and of which all runs passed: the Pareto front. Of designs
             with the same values, the first. Empty without an objective
    """

    plan: Plan
    table: Path
    done: int
    reasons: Counter[str]
    designs: tuple[Design, ...]
    best: tuple[Design, ...]

    @property
    def failed(self) -> int:
        """The number of runs that failed."""
        return self.reasons.total()

    @property
    def passed(self) -> int:
        """The number of runs that passed."""
        return self.done - self.failed

    @property
    def missing(self) -> int:
        """The number of runs that are not finished."""
        return self.plan.runs - self.done

    def to_json(self) -> dict[str, Any]:
        """The object that `kbot sweep --json` prints."""
        return {
            "schema": SCHEMA,
            "method": str(self.plan.method),
            "runs": self.plan.runs,
            "passed": self.passed,
            "failed": self.failed,
            "missing": self.missing,
            "table": str(self.table),
            "objectives": {each.name: each.direction for each in self.plan.objectives},
            "best": [
                {"design": each.number, "values": each.values, "objectives": each.objectives}
                for each in self.best
            ],
        }


def results_of(plan: Plan, journal: Journal, table: Path) -> Results:
    """The results of the runs that a journal has. Reads them once: there may be a million."""
    names = [each.name for each in plan.space.dimensions]
    goals = [each.name for each in plan.objectives]
    reasons: Counter[str] = Counter()
    designs: dict[int, Design] = {}
    for number, found in groupby(journal.rows(), key=lambda row: row.design):
        rows = tuple(found)
        failures = tuple(row.reason or "" for row in rows if not row.passed)
        reasons.update(failures)
        if len(rows) == len(plan.trials):
            values = dict(zip(names, rows[0].values, strict=True))
            objectives = dict(zip(goals, plan.objective_values(rows), strict=True))
            designs[number] = Design(number, values, objectives, failures)
    passed = {each.number: tuple(each.objectives.values()) for each in designs.values() if each.passed}
    best: dict[Values, Design] = {}
    numbers = front(plan.objectives, passed) if goals else ()
    for number in numbers:  # of equal designs, the first comes first
        best.setdefault(tuple(designs[number].values.values()), designs[number])
    return Results(plan, table, journal.count, reasons, tuple(designs.values()), tuple(best.values()))
