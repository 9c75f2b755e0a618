"""`kbot sweep`: run scenarios with many values of a robot, and find the best ones."""

from __future__ import annotations

import sys
import time
from collections.abc import Sequence
from contextlib import ExitStack
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import click

from kbot.cli.arguments import (
    Within,
    collect_options,
    examples,
    file_and_arguments,
    jobs_option,
    json_option,
    package_path_option,
)
from kbot.cli.output import fail, print_json, print_note, report_unwritten, unwritten_reported
from kbot.cli.progress import busy, counting
from kbot.text.outputs import require_different, require_place, require_report_place

if TYPE_CHECKING:
    from kbot.sweep.executor import Executor
    from kbot.sweep.plan import Plan
    from kbot.sweep.preparation import Request
    from kbot.sweep.results import Design, Results
    from kbot.trials.pool import Pool

COMPLETE, ALL_FAILED, INTERRUPTED = 0, 1, 130
METHODS = ("grid", "random", "lhs", "optimize")


@dataclass(frozen=True, slots=True)
class _PlanOptions:
    """The options that define the plan: what is run."""

    dimensions: tuple[str, ...]
    scenarios: tuple[str, ...]
    objectives: tuple[str, ...]
    method: str
    runs: int | None
    package_path: tuple[str, ...]


@dataclass(frozen=True, slots=True)
class _ExecutionOptions:
    """The options of the execution, and the folder for its results."""

    out: str | None
    jobs: int | None
    limit_time: float | None
    confirmed: bool
    on: str | None


@dataclass(frozen=True, slots=True)
class _Outputs:
    """The options of the files that are written after the runs, besides the table."""

    html: str | None
    write: str | None
    diff: bool
    design: int | None


@click.command(
    "sweep",
    epilog=examples(
        "kbot sweep kbot --set wheel_radius=0.02:0.05:7 --scenario straight --out a",
        "kbot sweep kbot --set world=empty,rooms --scenario all --out b --html b.html",
        "kbot sweep r.xacro --set track=0.2:0.4:9 --scenario circle --out c --on ray",
    ),
)
@click.argument("words", nargs=-1, metavar="FILE [name:=value ...]")
@click.option(
    "--set",
    "dimensions",
    multiple=True,
    metavar="NAME=VALUES",
    help="What varies: low:high:count, low:high, or a list a,b,c. NAME is an argument or top-level property "
    "of the robot, world, a parameter such as world.height, seed, or a key such as scenario.duration. "
    "Can be repeated.",
)
@click.option(
    "--scenario",
    "scenarios",
    multiple=True,
    metavar="NAME|FILE",
    help="Scenario to run: a battery or a scenario file, as for kbot try --battery. Can be repeated.",
)
@click.option(
    "--objective",
    "objectives",
    multiple=True,
    metavar="MEASURE[:max]",
    help="Measure to minimise, or with :max to maximise. Can be repeated.",
)
@click.option(
    "--method",
    type=click.Choice(METHODS),
    default="grid",
    show_default=True,
    help="How the combinations are chosen: all, at random, as a Latin hypercube, or by earlier results.",
)
@click.option(
    "--runs",
    type=click.IntRange(1),
    metavar="N",
    show_default="all of a grid",
    help="Number of combinations to run. Each runs once for each scenario and seed.",
)
@click.option(
    "--out",
    metavar="DIR",
    help="Folder for the results. The same command continues an interrupted sweep in it.",
)
@jobs_option
@click.option(
    "--on",
    metavar="ray[://HOST:PORT]",
    help="Run on a Ray cluster: ray for one on this machine, ray://HOST:10001 or HOST:6379 for another.",
)
@click.option(
    "--html",
    metavar="FILE",
    help="Report with parallel coordinates, Pareto front, sensitivity, and a film of the best run.",
)
@click.option(
    "--write",
    metavar="FILE",
    help="Xacro of the best design: the robot's files with its values at the lines that define them.",
)
@click.option("--diff", is_flag=True, help="Print the changes of --write without writing.")
@click.option(
    "--design",
    type=click.IntRange(0),
    metavar="N",
    help="Design to write and to film, if several are best.",
)
@click.option(
    "--yes",
    "confirmed",
    is_flag=True,
    help="Run a very large sweep, and let --write overwrite files without a question.",
)
@click.option(
    "--limit-time",
    type=Within(1.0, 86400.0),
    metavar="SECONDS",
    show_default="30, and 2 for each simulated second",
    help="Maximum processor time of one run in seconds.",
)
@json_option
@package_path_option
@collect_options("options", _PlanOptions)
@collect_options("execution", _ExecutionOptions)
@collect_options("outputs", _Outputs)
def command(
    words: tuple[str, ...],
    options: _PlanOptions,
    execution: _ExecutionOptions,
    outputs: _Outputs,
    as_json: bool,
) -> int:
    """Run scenarios with many values of a robot, and find the best values.

    Each combination of the values of --set is a design. Its runs are rows of DIR/results.parquet, with the
    values, all measures, and the reason of each failure.

    After any interruption, the same command continues: finished runs are not run again. A larger --runs
    extends a sweep. name:=value sets an argument or property that does not vary.

    Exit status: 0 the sweep is complete; 1 it is complete, and all runs failed; 2 unusable input; 130 Ctrl-C,
    after the results so far.
    """
    with ExitStack() as opened:
        try:
            with unwritten_reported(outputs.html, outputs.write):
                ran = _run(words, options, execution, outputs, opened)
            text = ran.results.to_json() if as_json else ran.summary()
        except (Exception, KeyboardInterrupt):  # Ctrl-C before the first run
            if as_json:
                from kbot.sweep.results import NO_RESULT

                print_json(NO_RESULT)
            raise
        if as_json:
            print_json(text)
        else:
            click.echo(text)
        if not ran.is_complete:
            done, runs = ran.results.done, ran.results.plan.runs
            print_note(f"interrupted after {done} of {runs} runs. The same command continues")
            report_unwritten(outputs.html, outputs.write)
            return INTERRUPTED
        _write_outputs(ran.results, outputs, execution, ran.pool, as_json=as_json)
        return COMPLETE if ran.results.passed else ALL_FAILED


@dataclass(frozen=True, slots=True)
class _SweepResult:
    """A sweep whose execution has ended: with the last run, or by Ctrl-C."""

    results: Results
    pool: Pool
    is_complete: bool
    seconds: float

    def summary(self) -> str:
        from kbot.sweep.summary import summary

        return summary(self.results, self.seconds)


def _run(
    words: tuple[str, ...],
    options: _PlanOptions,
    execution: _ExecutionOptions,
    outputs: _Outputs,
    opened: ExitStack,
) -> _SweepResult:
    """Run what is missing. The pool and the folder stay open until `opened` ends."""
    request = _request(words, options)
    if not execution.out:
        fail("--out DIR is missing: the folder for the results")
    _check_outputs(outputs, options, execution.out, confirmed=execution.confirmed)
    if execution.on is not None:
        from kbot.sweep.cluster import parse_place

        parse_place(execution.on)
    from kbot.sweep.preparation import prepare
    from kbot.sweep.rehearsal import rehearse
    from kbot.sweep.runner import opened_sweep
    from kbot.trials.pool import Pool

    begun = time.monotonic()
    pool = opened.enter_context(Pool(execution.jobs))
    with busy(f"preparing {request.robot}"):
        plan = prepare(request, pool)
    sweep = opened.enter_context(opened_sweep(plan, execution.out))
    if sweep.journal.count and sweep.missing:
        print_note(f"continuing: {sweep.journal.count} of {plan.runs} runs are finished")
    has_searched, is_complete = False, True
    try:
        with busy("running the first design"):
            rehearse(sweep, pool, execution.limit_time, confirmed=execution.confirmed)
        with (
            counting("running", sweep.missing) as advance,
            _executor(execution, plan, pool, execution.out) as executor,
        ):
            has_searched = True
            sweep.run(executor, advance)
    except KeyboardInterrupt:
        if not sweep.journal.count:  # no run is finished
            raise
        is_complete = False
        if not has_searched:  # Ctrl-C came before the search, which writes the table itself
            sweep.write_finished()
    return _SweepResult(sweep.results(), pool, is_complete, time.monotonic() - begun)


def _executor(execution: _ExecutionOptions, plan: Plan, pool: Pool, out: str) -> Executor:
    """Where the runs are executed."""
    from kbot.sweep.processes import Processes

    if execution.on is None:
        return Processes(pool, execution.limit_time)
    from kbot.sweep.cluster import RayCluster, parse_place
    from kbot.sweep.preparation import RUN_PROGRAMS

    versions = {name: plan.versions[name] for name in RUN_PROGRAMS if name in plan.versions}
    return RayCluster(parse_place(execution.on), execution.jobs, execution.limit_time, versions, [out])


def _check_outputs(outputs: _Outputs, options: _PlanOptions, out: str, *, confirmed: bool) -> None:
    """Report before the runs what cannot be written after them."""
    from kbot.sweep.folder import FILES  # imported lazily, so that -h stays fast
    from kbot.trials.reports.html import MARK

    if outputs.html:
        require_report_place(outputs.html, MARK)
    if outputs.write:
        require_place(outputs.write)
    require_different(
        [*(str(Path(out, name)) for name in FILES), *filter(None, (outputs.html, outputs.write))]
    )
    if outputs.write is None:
        if outputs.diff:
            fail("--diff shows the changes of --write FILE, which is missing")
        if outputs.design is not None and outputs.html is None:
            fail("--design chooses what --write and --html show, and both are missing")
        return
    if not options.objectives:
        fail("--write needs --objective MEASURE, which decides which design is best")
    may_ask = sys.stdin.isatty() and sys.stderr.isatty()
    if Path(outputs.write).exists() and not (outputs.diff or confirmed or may_ask):
        fail(f"{outputs.write} exists. Add --yes to overwrite it, or --diff to see the changes")


def _write_outputs(
    results: Results, outputs: _Outputs, execution: _ExecutionOptions, pool: Pool, *, as_json: bool
) -> None:
    from kbot.sweep.best_design import chosen_design

    best = results.best
    if outputs.html is not None:
        from kbot.sweep.report.html import film_of, write_report

        shown = (
            chosen_design(best, outputs.design if outputs.design is not None else best[0].number)
            if best
            else None
        )
        film = None
        with unwritten_reported(outputs.html, outputs.write):
            if shown is not None:
                with busy(f"filming design {shown.number}"):
                    film = film_of(results.plan, shown, pool, execution.limit_time)
            write_report(outputs.html, results, shown, film)
        print_note(f"wrote {outputs.html}")
    if outputs.write is not None:
        _write_design(
            results.plan,
            chosen_design(best, outputs.design),
            outputs.write,
            outputs,
            execution,
            as_json=as_json,
        )


def _write_design(
    plan: Plan, design: Design, path: str, outputs: _Outputs, execution: _ExecutionOptions, *, as_json: bool
) -> None:
    """Write a design, or print it as a diff. Existing files are overwritten only if the user agrees."""
    from kbot.sweep.best_design import written_design

    written = written_design(plan, design, path)
    existing = written.existing()
    if outputs.diff or (existing and not execution.confirmed):
        click.echo(written.diff(), nl=False, err=as_json or not outputs.diff)
    if outputs.diff:
        return
    if existing and not execution.confirmed and not _agrees(existing):
        print_note("nothing was written")
        return
    written.write()
    if not written.changes:
        print_note("the robot's files already have the values of this design")
    for change in written.changes:
        print_note(f"  {change}")
    for value in written.elsewhere:
        print_note(f"  {value} is not part of the robot")
    print_note(f"wrote design {design.number}: {', '.join(written.paths)}")


def _agrees(existing: Sequence[str]) -> bool:
    """Ask whether files may be overwritten."""
    names = ", ".join(existing)
    if not (sys.stdin.isatty() and sys.stderr.isatty()):
        fail(f"{names} would be overwritten. Add --yes to do so, or --diff to see the changes")
    return click.confirm(f"Overwrite {names}?", err=True)


def _request(words: tuple[str, ...], options: _PlanOptions) -> Request:
    from kbot.sweep.designs import Method
    from kbot.sweep.preparation import Request

    file, values = file_and_arguments(words)
    return Request(
        robot=file,
        dimensions=options.dimensions,
        scenarios=options.scenarios,
        objectives=options.objectives,
        method=Method(options.method),
        runs=options.runs,
        values=values,
        packages=options.package_path,
    )
