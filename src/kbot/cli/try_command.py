"""`kbot try`: run scenarios as tests of a robot's behaviour, in parallel."""

from __future__ import annotations

import sys
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from datetime import datetime
from pathlib import Path
from typing import TYPE_CHECKING

import click

from kbot.cli.arguments import (
    Within,
    collect_options,
    examples,
    jobs_option,
    json_option,
    package_path_option,
    split_arguments,
)
from kbot.cli.output import (
    fail,
    has_color,
    print_json,
    print_note,
    report_error,
    report_unwritten,
    unwritten_reported,
)
from kbot.cli.progress import busy, counting
from kbot.text import KbotError
from kbot.text.files import write_text
from kbot.text.outputs import require_different, require_report_place

if TYPE_CHECKING:
    from kbot.trials.pool import Pool, Task
    from kbot.trials.results import TrialResult
    from kbot.trials.selection import Selection

PASSED, FAILED, UNUSABLE, INTERRUPTED = 0, 1, 2, 130
_NOT_RUN = "KBot was interrupted before this trial ended"


@dataclass(frozen=True, slots=True)
class _Choice:
    """What is tried."""

    battery: tuple[str, ...]
    seed: tuple[int, ...]
    package_path: tuple[str, ...]


@dataclass(frozen=True, slots=True)
class _Running:
    """How the trials run."""

    jobs: int | None
    limit_time: float | None
    keep: str | None


@dataclass(frozen=True, slots=True)
class _Reports:
    """Where the results go."""

    as_json: bool
    junit: str | None
    html: str | None
    csv: str | None

    @property
    def paths(self) -> tuple[str | None, ...]:
        return self.junit, self.html, self.csv

    def require_writable(self) -> None:
        """Raises KbotError: a file cannot be written, or is not a report. The trials may take long."""
        from kbot.trials.reports import grades, html, junit  # imported lazily, so that -h stays fast

        reports = ((self.junit, junit.MARK), (self.html, html.MARK), (self.csv, grades.MARK))
        marks = [(path, mark) for path, mark in reports if path]
        for path, mark in marks:
            require_report_place(path, mark)
        require_different([path for path, _ in marks])


@click.command(
    "try",
    epilog=examples(
        ("kbot try drive.scenario.yaml", "run a scenario"),
        ("kbot try tests -j 4 --junit results.xml", "all scenarios of a folder"),
        ("kbot try robot.xacro --battery all", "the built-in scenarios"),
        "kbot try drive.scenario.yaml wheel_radius:=0.04 --seed 1 --seed 2",
        "kbot try --battery task.scenario.yaml student/*/ --csv grades.csv",
    ),
)
@click.argument("words", nargs=-1, metavar="PATH... [name:=value ...]")
@click.option(
    "--battery",
    multiple=True,
    metavar="NAME|FILE|all",
    help="Try the robots PATH with a built-in battery, with the scenarios of a file, or with all built-in "
    "batteries. Can be repeated.",
)
@jobs_option
@click.option(
    "--seed",
    type=click.IntRange(0),
    multiple=True,
    metavar="N",
    help="Seed to use instead of those of the scenarios. Can be repeated.",
)
@json_option
@click.option("--junit", metavar="FILE", help="Write the results to FILE as JUnit XML.")
@click.option(
    "--html",
    metavar="FILE",
    help="Write the results to FILE as one web page, with paths, plots, and films of the failed trials.",
)
@click.option(
    "--csv", metavar="FILE", help="Write a table with a row for each robot to FILE. Needs --battery."
)
@click.option(
    "--keep",
    metavar="DIR",
    show_default=".kbot/trials",
    help="Folder for the recordings of failed trials.",
)
@click.option(
    "--limit-time",
    type=Within(1.0, 86400.0),
    metavar="SECONDS",
    show_default="30, and 2 for each simulated second",
    help="Most processor time of one trial.",
)
@click.option("--schema", is_flag=True, help="Print the JSON Schema of scenario files and exit.")
@click.option(
    "--list", "only_list", is_flag=True, help="Print the names of the trials, or of the batteries, and exit."
)
@package_path_option
@collect_options("choice", _Choice)
@collect_options("running", _Running)
@collect_options("reports", _Reports)
def command(
    words: tuple[str, ...],
    choice: _Choice,
    running: _Running,
    reports: _Reports,
    schema: bool,
    only_list: bool,
) -> int:
    """Run scenarios, which test a robot's behaviour.

    PATH is a scenario file (.yaml, .yml or .py) or a folder, in which all files *.scenario.yaml,
    *.scenario.yml and *.scenario.py are run. With --battery, PATH is a robot: a file, a package, or kbot.

    name:=value sets a xacro argument of the robots or, if they have no argument of that name, a top-level
    property.

    Trials run in parallel. Equal inputs give equal results, bit for bit. A failed trial is run again with a
    recording, which kbot view shows.

    Exit status: 0 all passed; 1 a trial failed; 2 a scenario or all robots cannot be used; 130 Ctrl-C, after
    the results so far. SIGTERM and a closed terminal also end with the results so far.
    """
    if schema:
        from kbot.trials.schema import json_schema

        print_json(json_schema())
        return PASSED
    try:
        return _try(words, choice, running, reports, only_list=only_list)
    except (Exception, KeyboardInterrupt):  # Ctrl-C between two trials
        if reports.as_json:
            from kbot.trials.results import to_json

            print_json(to_json(()))
        raise


def _try(
    words: Sequence[str], choice: _Choice, running: _Running, reports: _Reports, *, only_list: bool
) -> int:
    paths, values = split_arguments(words)
    if only_list and not paths and not choice.battery:
        return _list_batteries()
    if not paths:
        fail("PATH is missing. Name a scenario file or a folder of them, or a robot with --battery all")
    if reports.csv is not None and not choice.battery:
        fail("--csv writes a row for each robot. Name the robots, and their scenarios with --battery")
    reports.require_writable()
    if running.keep is not None and Path(running.keep).exists() and not Path(running.keep).is_dir():
        fail(f"--keep takes a folder, and {running.keep} is a file")
    from kbot.trials.pool import Pool  # imported lazily, so that -h stays fast

    begun, clock = datetime.now().astimezone(), time.monotonic()
    with unwritten_reported(*reports.paths), Pool(running.jobs) as pool:
        selection = _select(pool, paths, values, choice)
        for error in selection.errors:
            report_error(error)
        for note in selection.notes:
            print_note(note)
        if only_list:
            _list(selection.tasks)
            return UNUSABLE if selection.errors else PASSED
        if not selection.tasks and not reports.as_json:
            if not pool.interrupted:
                return UNUSABLE
            report_unwritten(*reports.paths)
            return INTERRUPTED
        done, left = _run(pool, selection.tasks, running, with_film=reports.html is not None)
    nothing_ran = all(task.error for task in selection.tasks)
    if nothing_ran and not selection.errors:
        for error in selection.robot_errors or _reasons(selection.tasks):
            report_error(error)
    is_written = _report(done, left, reports, begun, time.monotonic() - clock, with_table=not nothing_ran)
    if pool.interrupted:
        return INTERRUPTED
    if selection.errors or nothing_ran or not is_written:
        return UNUSABLE
    return PASSED if all(result.passed for _, result in done) else FAILED


def _reasons(tasks: Sequence[Task]) -> list[KbotError]:
    """Why trials cannot run, each reason once."""
    return [KbotError(reason) for reason in dict.fromkeys(task.error for task in tasks)]


def _select(pool: Pool, paths: Sequence[str], values: dict[str, str], choice: _Choice) -> Selection:
    from kbot.trials.selection import Overrides, select_batteries, select_scenarios

    overrides = Overrides(values, choice.package_path, choice.seed)
    with busy("reading scenarios"):
        if choice.battery:
            return select_batteries(pool, paths, choice.battery, overrides)
        return select_scenarios(pool, paths, overrides)


def _run(
    pool: Pool, tasks: Sequence[Task], running: _Running, *, with_film: bool
) -> tuple[list[tuple[Task, TrialResult]], list[Task]]:
    """Run the trials, and the failed ones again with a recording. Returns those that are done, and those that
    did not run, because of Ctrl-C.

    `with_film` keeps what a web page shows: the traces, and films of the failed trials.
    """
    from kbot.trials.pool import run_tasks
    from kbot.trials.recordings import record_failures

    tasks = [replace(task, with_trace=with_film) for task in tasks]
    with counting("running trials", len(tasks)) as advance:
        results = run_tasks(pool, tasks, lambda index, result: advance(), running.limit_time)
    done = [(task, result) for task, result in zip(tasks, results, strict=True) if result is not None]
    left = [task for task, result in zip(tasks, results, strict=True) if result is None]
    if pool.interrupted or not done:
        return done, left
    ran, found = [task for task, _ in done], [result for _, result in done]
    folder = None if running.keep is None else Path(running.keep)
    with counting("recording failed trials", sum(not result.passed for result in found)) as advance:
        try:
            found = record_failures(
                pool,
                ran,
                found,
                folder,
                lambda index, result: advance(),
                running.limit_time,
                with_film=with_film,
            )
        except OSError as error:
            print_note(f"failed trials are not recorded: {error.filename}: {error.strerror}")
        except KeyboardInterrupt:  # between two of them
            pool.interrupted = True
    return list(zip(ran, found, strict=True)), left


def _report(
    done: Sequence[tuple[Task, TrialResult]],
    left: Sequence[Task],
    reports: _Reports,
    begun: datetime,
    seconds: float,
    *,
    with_table: bool,
) -> bool:
    """Print the results and write the files. Returns whether all files could be written.

    In the files, a trial in `left`, which did not run, has failed: a part of a run must not look like all.
    """
    from kbot.trials.reports.grades import grades
    from kbot.trials.reports.html import write_html
    from kbot.trials.reports.junit import junit
    from kbot.trials.reports.table import summary, table
    from kbot.trials.results import TrialResult, to_json

    missed = [(task, TrialResult(task.scenario.name, task.seed, error=_NOT_RUN)) for task in left]
    pairs = [*done, *missed]
    names_robots = len({task.robot for task, _ in pairs}) > 1
    results = [
        replace(result, name=f"{task.robot}: {result.name}") if names_robots else result
        for task, result in pairs
    ]
    outputs: tuple[tuple[str | None, Callable[[str], object]], ...] = (
        (reports.junit, lambda path: write_text(path, junit(results, begun))),
        (reports.csv, lambda path: write_text(path, grades((task.robot, result) for task, result in pairs))),
        (reports.html, lambda path: write_html(path, results)),
    )
    is_written = True
    for path, write in outputs:
        try:
            if path is not None:
                write(path)
        except (KbotError, OSError) as error:  # the other outputs still have the results
            report_error(error)
            is_written = False
    if reports.as_json:
        print_json(to_json(results))
    elif with_table:
        color = has_color(sys.stdout)
        shown = results[: len(done)]
        click.echo(table(shown, color=color) + summary(shown, seconds, not_run=len(left), color=color))
    return is_written


def _list(tasks: Sequence[Task]) -> None:
    for task in tasks:
        seed = f" (seed {task.seed})" if task.seed else ""
        click.echo(f"{task.scenario.name}{seed}")


def _list_batteries() -> int:
    from kbot.trials.selection import battery_texts

    for name, text in battery_texts().items():
        click.echo(f"{name:<20}{text}")
    return PASSED
