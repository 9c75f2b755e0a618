"""Runs a sweep: submits what is missing in the journal, and records each result at once."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from typing import NamedTuple

from kbot.sweep.designs import Designs, Grid, LatinHypercube, Method, Random
from kbot.sweep.executor import Executor
from kbot.sweep.journal import DELETE, Journal, Row
from kbot.sweep.objectives import Objective
from kbot.sweep.plan import Plan
from kbot.sweep.space import Space, Values
from kbot.text import KbotError


class MissingRun(NamedTuple):
    """A run that the journal does not have, with the values of its design.

    `same_as` is the run of an earlier design with the same values, which has the same result.
    """

    run: int
    values: Values
    same_as: int | None = None


def search(
    plan: Plan, journal: Journal, executor: Executor, on_done: Callable[[], object] = lambda: None
) -> None:
    """Execute the runs that the journal does not have. `on_done` is called after each.

    A design that has the values of an earlier one is not executed: its rows repeat the earlier results. The
    order in which runs end has no influence on the designs. Ctrl-C raises KeyboardInterrupt, and a full disk
    raises KbotError: in both cases the journal has every run that ended before.
    """
    waiting: dict[int, Values] = {}
    repeated: dict[int, list[int]] = {}
    """The runs that repeat the result of a run, which is not finished."""

    def record(row: Row) -> None:
        journal.append(row)
        on_done()
        for run in repeated.pop(row.run, ()):
            record(plan.repeated_row(run, row))

    missing = _Missing(plan, journal)
    while True:
        while len(waiting) < executor.capacity and (found := missing.next()) is not None:
            run, values, same_as = found
            if same_as is None:
                waiting[run] = values
                executor.submit(run, plan.task(run, values))
            elif same_as in journal:
                record(plan.repeated_row(run, journal.row(same_as)))
            else:
                repeated.setdefault(same_as, []).append(run)
        if not waiting:
            return
        run, result = executor.wait()
        record(plan.row(run, waiting.pop(run), result))


def first_missing(plan: Plan, journal: Journal) -> MissingRun | None:
    """The first run that the journal does not have. None if it has all."""
    return _Missing(plan, journal).next()


def designs_of(method: Method, space: Space, count: int, objectives: Sequence[Objective]) -> Designs:
    """The designs of a method."""
    if method is Method.GRID:
        return Grid(space)
    if method is Method.RANDOM:
        return Random(space)
    if method is Method.LHS:
        return LatinHypercube(space, count)
    from kbot.sweep.optimisation import Optimisation  # Optuna is an extra

    return Optimisation(space, objectives)


class _Missing:
    """The runs that the journal does not have, in order."""

    def __init__(self, plan: Plan, journal: Journal) -> None:
        self._plan, self._journal = plan, journal
        self._designs: Designs = designs_of(plan.method, plan.space, plan.designs, plan.objectives)
        self._each = len(plan.trials)
        self._reported = 0
        """The number of designs that are reported, which are the first ones."""
        self._chosen = 0
        """The number of designs that were chosen or skipped."""
        self._queue: Iterator[MissingRun] = iter(())
        # random numbers of an interval are never equal, and a dictionary of a million would need memory
        is_drawn = plan.method in (Method.RANDOM, Method.LHS)
        self._may_repeat = plan.method is Method.OPTIMIZE or (is_drawn and plan.space.size is not None)
        self._first: dict[Values, int] = {}
        """The first design with each combination of values."""

    def next(self) -> MissingRun | None:
        """The next run. None if none can begin before the next result."""
        while True:
            found = next(self._queue, None)
            if found is not None:
                return found
            if self._chosen == self._plan.designs or not self._can_choose():
                return None
            self._choose()

    def _can_choose(self) -> bool:
        window = self._designs.window
        if window is None:
            return True
        while self._reported <= self._chosen - window:
            if not all(run in self._journal for run in self._runs(self._reported)):
                return False
            self._report(self._reported)
            self._reported += 1
        return True

    def _choose(self) -> None:
        design = self._chosen
        self._chosen += 1
        missing = [run for run in self._runs(design) if run not in self._journal]
        values = self._designs.values(design)
        for run in self._runs(design):
            if run in self._journal:
                self._require_same(self._journal.row(run), design, values)
        earlier = self._earlier(design, values)
        self._queue = iter(
            MissingRun(run, values, None if earlier is None else run - (design - earlier) * self._each)
            for run in missing
        )

    def _earlier(self, design: int, values: Values) -> int | None:
        """An earlier design with the same values."""
        first = self._first.setdefault(values, design) if self._may_repeat else design
        return first if first < design else None

    def _require_same(self, row: Row, design: int, values: Values) -> None:
        """Raises KbotError: the journal was edited, and a row is not of its run's design."""
        if (row.design, row.values) != (design, values):
            found, wanted = (", ".join(map(str, each)) for each in (row.values, values))
            where = self._journal.place(row.run, "values")
            raise KbotError(
                f"{where}: run {row.run} is recorded for design {row.design} with {found}, but it is of "
                f"design {design} with {wanted}. {DELETE}"
            )

    def _report(self, design: int) -> None:
        rows = [self._journal.row(run) for run in self._runs(design)]
        objectives = self._plan.objective_values(rows)
        is_measured = all(value == value for value in objectives) and all(row.measures for row in rows)
        self._designs.report(
            design, objectives if is_measured else None, passed=all(row.passed for row in rows)
        )

    def _runs(self, design: int) -> range:
        return range(design * self._each, (design + 1) * self._each)
