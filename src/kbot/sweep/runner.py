"""Runs a sweep in a folder, from what the user asked for to the table."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from itertools import groupby
from pathlib import Path
from typing import Any

from kbot.sweep.designs import Method
from kbot.sweep.executor import Executor
from kbot.sweep.folder import TABLE, opened_folder
from kbot.sweep.journal import Journal, Row
from kbot.sweep.objectives import front
from kbot.sweep.plan import Plan
from kbot.sweep.preparation import Request, prepare
from kbot.sweep.processes import Processes
from kbot.sweep.search import search
from kbot.sweep.table import write_table
from kbot.text import KbotError
from kbot.text.suggest import suggest_or_list
from kbot.trials.measures import FAMILIES
from kbot.trials.pool import Pool, run_tasks
from kbot.trials.results import TrialResult

SCHEMA = 1
"""Version of the JSON of `kbot sweep`."""
MANY_RUNS, LONG_SECONDS = 100_000, 86_400.0
"""More runs, or a longer time, must be confirmed: most are a slip in a range."""
SOME_RUNS = 1000
"""Fewer runs are not timed beforehand."""
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
_UNITS = (("year", 31_557_600.0), ("day", 86_400.0), ("hour", 3600.0), ("minute", 60.0), ("second", 1.0))


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
                write_table(self.table, self.plan, self.journal)
            raise
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


def checked_plan(request: Request, pool: Pool, *, confirmed: bool = False) -> Plan:
    """The plan of a sweep that can run.

    `confirmed`: the user knows that it has very many runs.

    Raises:
        KbotError: the request cannot be run, or must be confirmed.
        KeyboardInterrupt: Ctrl-C.
    """
    plan = prepare(request, pool)
    families = [each.name for each in plan.objectives if each.name.partition("/")[0] in FAMILIES]
    if families or (plan.runs > SOME_RUNS and not confirmed):
        trial, seconds = _try(plan, pool)
        _require_parts(families, trial)
        if not confirmed:
            _require_confirmed(plan, seconds / pool.jobs)
    return plan


@contextmanager
def opened_sweep(plan: Plan, out: str) -> Iterator[Sweep]:
    """Begin a sweep in the folder `out`, or continue it. Within the block, the folder is locked.

    Raises:
        KbotError: the folder has another sweep, another process uses it, or it cannot be written.
    """
    with opened_folder(out, plan) as journal:
        yield Sweep(plan, journal, Path(out))


def _try(plan: Plan, pool: Pool) -> tuple[TrialResult, float]:
    """Run the robot as it is described once. Returns the result, and the seconds that it took."""
    begun = time.perf_counter()
    (result,) = run_tasks(pool, plan.trials[:1])
    if result is None:
        raise KeyboardInterrupt
    return result, time.perf_counter() - begun


def _require_parts(names: Sequence[str], trial: TrialResult) -> None:
    """Raises KbotError: an objective such as `support/NAME` is about something that the robot does not have.

    A run that failed measured nothing, and shows nothing about it.
    """
    for name in names:
        if trial.all_values and name not in trial.all_values:
            family = name.partition("/")[0]
            known = [each for each in trial.all_values if each.startswith(f"{family}/")]
            hint = suggest_or_list(name, known)
            raise KbotError(f"--objective {name}: the scenario {trial.name} does not measure it: {hint}")


def _require_confirmed(plan: Plan, seconds: float) -> None:
    """Raises KbotError: a sweep has very many runs. `seconds` is the time of one of them."""
    total = plan.runs * seconds
    if plan.runs > MANY_RUNS or total > LONG_SECONDS:
        counts = " x ".join(str(each.count) for each in plan.space.dimensions if each.count)
        product = f" ({counts})" if plan.method is Method.GRID and len(plan.space.dimensions) > 1 else ""
        raise KbotError(
            f"the sweep has {plan.runs} runs{product}, which take about {duration(total)} on this machine. "
            "To run it nevertheless, add --yes"
        )


def duration(seconds: float) -> str:
    """A duration in its largest unit, such as `3 hours`."""
    name, unit = next((each for each in _UNITS if seconds >= each[1]), _UNITS[-1])
    count = max(1, round(seconds / unit))
    return f"{count} {name}{'s' if count > 1 else ''}"


def sweep(
    robot: str,
    dimensions: Mapping[str, str | Sequence[int | float | str]],
    scenario: str | Sequence[str],
    out: str,
    *,
    objectives: str | Sequence[str] = (),
    method: str = "grid",
    runs: int | None = None,
    values: Mapping[str, object] | None = None,
    packages: Sequence[str] = (),
    jobs: int | None = None,
    limit: float | None = None,
    confirmed: bool = False,
) -> Path:
    """Run a sweep as `kbot sweep` does. Returns the path of the table.

    `dimensions` has the values by name, as a text such as `0.02:0.05:7` or as a list. `values` do not vary.
    `limit` is the processor time in seconds that each run may take.

    Raises:
        KbotError: the request cannot be run, or the folder `out` cannot be written.
    """
    request = Request(
        robot=robot,
        dimensions=[f"{name}={_text(each)}" for name, each in dimensions.items()],
        scenarios=[scenario] if isinstance(scenario, str) else scenario,
        objectives=[objectives] if isinstance(objectives, str) else objectives,
        method=_method(method),
        runs=runs,
        values={name: str(value) for name, value in (values or {}).items()},
        packages=tuple(packages),
    )
    with Pool(jobs) as pool:
        plan = checked_plan(request, pool, confirmed=confirmed)
        with opened_sweep(plan, out) as opened, Processes(pool, limit) as executor:
            opened.run(executor)
            return opened.table


def _text(values: str | Sequence[int | float | str]) -> str:
    return values if isinstance(values, str) else ",".join(map(str, values))


def _method(name: str) -> Method:
    try:
        return Method(name)
    except ValueError:
        raise KbotError(f"unknown method '{name}': {suggest_or_list(name, list(Method))}") from None
