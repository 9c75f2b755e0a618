"""Runs the first missing runs of a sweep alone: only they show how long a run takes, and what it measures."""

from __future__ import annotations

import time
from collections.abc import Sequence

from kbot.sweep.designs import Method
from kbot.sweep.plan import Plan
from kbot.sweep.runner import Sweep
from kbot.sweep.search import first_missing
from kbot.sweep.space import Space, Values
from kbot.text import KbotError
from kbot.text.notes import note
from kbot.text.suggest import suggest_or_list
from kbot.trials.measures import FAMILIES
from kbot.trials.pool import Pool, run_tasks
from kbot.trials.results import TrialResult

MANY_RUNS, LONG_SECONDS = 100_000, 86_400.0
"""More runs, or a longer time, must be confirmed: usually a typing error in a range."""
_UNITS = (("year", 31_557_600.0), ("day", 86_400.0), ("hour", 3600.0), ("minute", 60.0), ("second", 1.0))


def rehearse(sweep: Sweep, pool: Pool, limit: float | None = None, *, confirmed: bool = False) -> None:
    """Check a sweep by its first missing runs, if there is something to learn from them, and record them.

    `limit` is the processor time in seconds that each run may take. `confirmed`: the user knows that the
    sweep has very many runs.

    Raises:
        KbotError: the sweep must be confirmed, or cannot measure an objective. Nothing is recorded.
        KeyboardInterrupt: Ctrl-C.
    """
    plan, missing = sweep.plan, sweep.missing
    longest = max(plan.task(run, _highest(plan.space)).limit(limit) for run in range(len(plan.trials)))
    may_be_long = missing > MANY_RUNS or missing * longest / pool.jobs > LONG_SECONDS
    varied = {each.name for each in plan.space.dimensions}
    measured = [each.name for each in plan.objectives if each.name not in varied]
    # without another run to wait for, the results themselves show what is measured
    shows_objectives = bool(measured) and not sweep.journal.count and missing > pool.jobs
    must_ask = may_be_long and not confirmed
    first = first_missing(plan, sweep.journal) if shows_objectives or must_ask else None
    if first is None:
        return
    run, values, _ = first
    runs = _first_of_each_scenario(plan) if shows_objectives else [run]
    begun = time.perf_counter()
    results = run_tasks(pool, [plan.task(each, values) for each in runs], limit=limit)
    seconds = time.perf_counter() - begun
    finished = [result for result in results if result is not None]
    if len(finished) < len(runs):
        raise KeyboardInterrupt
    if shows_objectives:
        _check_objectives(plan, measured, finished)
    if must_ask:
        _require_confirmed(plan, missing, missing * seconds / max(pool.jobs, len(runs)))
    for each, result in zip(runs, finished, strict=True):
        sweep.journal.append(plan.row(each, values, result))


def _highest(space: Space) -> Values:
    """The highest number of each dimension, such as the longest duration of the scenario."""
    samples = [each.domain.samples() for each in space.dimensions]
    return tuple(each[0] if isinstance(each[0], str) else max(each, key=float) for each in samples)


def _first_of_each_scenario(plan: Plan) -> list[int]:
    """The runs of the first design with the first seed of each scenario."""
    first: dict[str, int] = {}
    for run, task in enumerate(plan.trials):
        first.setdefault(task.scenario.name, run)
    return list(first.values())


def _check_objectives(plan: Plan, names: Sequence[str], results: Sequence[TrialResult]) -> None:
    """Report objectives that the first design does not measure. It may just miss a goal, for example.

    A run that failed before it was measured shows nothing about them.

    Raises:
        KbotError: an objective such as `support/NAME` is about a part that no design has.
    """
    measured = [result.all_values for result in results if result.all_values]
    for name in names if measured else ():
        values = [found[name] for found in measured if name in found]
        family, _, part = name.partition("/")
        if not values and family in FAMILIES and part not in plan.optional_parts:
            known = {each for found in measured for each in found if each.startswith(f"{family}/")}
            hint = suggest_or_list(name, sorted(known))
            raise KbotError(f"--objective {name}: the scenarios do not measure it: {hint}")
        if all(value != value for value in values):
            note(
                f"--objective {name}: the first design has no value of it. "
                "A design without one cannot be the best"
            )


def _require_confirmed(plan: Plan, missing: int, seconds: float) -> None:
    """Raises KbotError: very many runs are missing, or they take very long together."""
    if missing <= MANY_RUNS and seconds <= LONG_SECONDS:
        return
    counts = [str(each.count) for each in plan.space.dimensions]
    is_whole_grid = plan.method is Method.GRID and plan.designs == plan.space.size
    product = " x ".join(counts) if is_whole_grid else str(plan.designs)
    if len(plan.trials) > 1:
        product = f" ({product} designs x {len(plan.trials)} runs)"
    else:
        product = f" ({product})" if is_whole_grid and len(counts) > 1 else ""
    which = f", and {missing} of them are missing. They" if missing < plan.runs else ", which"
    raise KbotError(
        f"the sweep has {plan.runs} runs{product}{which} take about {duration(seconds)} on this machine. "
        "Add --yes to run it anyway"
    )


def duration(seconds: float) -> str:
    """A duration in its largest unit, such as `3 hours`."""
    name, unit = next((each for each in _UNITS if seconds >= each[1]), _UNITS[-1])
    count = max(1, round(seconds / unit))
    return f"{count} {name}{'s' if count > 1 else ''}"
