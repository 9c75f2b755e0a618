"""The function `sweep` of Python: runs a sweep, as the command `kbot sweep` does."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path

from kbot.sweep.designs import Method
from kbot.sweep.preparation import Request, prepare
from kbot.sweep.processes import Processes
from kbot.sweep.rehearsal import rehearse
from kbot.sweep.runner import opened_sweep
from kbot.text import KbotError
from kbot.text.suggest import suggest_or_list
from kbot.trials.pool import Pool


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
    with Pool(jobs) as pool, opened_sweep(prepare(request, pool), out) as opened:
        rehearse(opened, pool, limit, confirmed=confirmed)
        with Processes(pool, limit) as executor:
            opened.run(executor)
        return opened.table


def _text(values: str | Sequence[int | float | str]) -> str:
    return values if isinstance(values, str) else ",".join(map(str, values))


def _method(name: str) -> Method:
    try:
        return Method(name)
    except ValueError:
        raise KbotError(f"unknown method '{name}': {suggest_or_list(name, list(Method))}") from None
