"""Runs the robot once before a sweep: only this shows how long a run takes, and what it measures."""

from __future__ import annotations

import time
from collections.abc import Sequence

from kbot.sweep.designs import Method
from kbot.sweep.plan import Plan
from kbot.sweep.preparation import Request, prepare
from kbot.text import KbotError
from kbot.text.suggest import suggest_or_list
from kbot.trials.measures import FAMILIES
from kbot.trials.pool import Pool, run_tasks
from kbot.trials.results import TrialResult

MANY_RUNS, LONG_SECONDS = 100_000, 86_400.0
"""More runs, or a longer time, must be confirmed: most are a slip in a range."""
SOME_RUNS = 1000
"""Fewer runs are not timed beforehand."""
_UNITS = (("year", 31_557_600.0), ("day", 86_400.0), ("hour", 3600.0), ("minute", 60.0), ("second", 1.0))


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
