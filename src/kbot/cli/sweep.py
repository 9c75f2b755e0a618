"""`kbot sweep`: run scenarios with many values of a robot, and find the best ones."""

from __future__ import annotations

import time
from dataclasses import dataclass
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
from kbot.cli.output import fail, print_json, print_note
from kbot.cli.progress import busy, counting

if TYPE_CHECKING:
    from kbot.sweep.preparation import Request

COMPLETE, ALL_FAILED, INTERRUPTED = 0, 1, 130
METHODS = ("grid", "random", "lhs", "optimize")


@dataclass(frozen=True, slots=True)
class _Choice:
    """What is run."""

    dimensions: tuple[str, ...]
    scenarios: tuple[str, ...]
    objectives: tuple[str, ...]
    method: str
    runs: int | None
    package_path: tuple[str, ...]


@dataclass(frozen=True, slots=True)
class _Running:
    """How it runs, and where the results go."""

    out: str | None
    jobs: int | None
    limit_time: float | None
    confirmed: bool


@click.command(
    "sweep",
    epilog=examples(
        (
            "kbot sweep robot.xacro --set wheel_radius=0.02:0.05:7 --scenario straight "
            "--objective energy --out wheels",
            "7 wheel radii",
        ),
        "kbot sweep kbot --set wheel_radius=0.02:0.05 --set world=empty,rooms --scenario drive.scenario.yaml "
        "--method lhs --runs 200 --out wheels",
        "kbot sweep kbot --set wheel_radius=0.02:0.05 --scenario straight --method optimize --runs 100 "
        "--objective energy --objective path_length:max --out wheels",
    ),
)
@click.argument("words", nargs=-1, metavar="FILE [name:=value ...]")
@click.option(
    "--set",
    "dimensions",
    multiple=True,
    metavar="NAME=VALUES",
    help="What varies: low:high:count, low:high, or a list a,b,c. NAME is an argument or top-level property "
    "of the robot, world, seed, or a key such as scenario.duration. Can be repeated.",
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
@click.option("--yes", "confirmed", is_flag=True, help="Run even very many combinations.")
@click.option(
    "--limit-time",
    type=Within(1.0, 86400.0),
    metavar="SECONDS",
    show_default="30, and 2 for each simulated second",
    help="Most processor time of one run.",
)
@json_option
@package_path_option
@collect_options("choice", _Choice)
@collect_options("running", _Running)
def command(words: tuple[str, ...], choice: _Choice, running: _Running, as_json: bool) -> int:
    """Run scenarios with many values of a robot, and find the best values.

    Each combination of the values of --set is a design. Its runs are rows of DIR/results.parquet, with the
    values, all measures, and the reason of each failure.

    After any interruption, the same command continues: finished runs are not run again. A larger --runs
    extends a sweep. name:=value sets an argument or property that does not vary.

    Exit status: 0 the sweep is complete; 1 it is complete, and all runs failed; 2 unusable input; 130 Ctrl-C,
    after the results so far.
    """
    try:
        return _sweep(words, choice, running, as_json=as_json)
    except Exception:
        if as_json:
            from kbot.sweep.runner import NO_RESULT

            print_json(NO_RESULT)
        raise


def _sweep(words: tuple[str, ...], choice: _Choice, running: _Running, *, as_json: bool) -> int:
    if running.out is None:
        fail("--out DIR is missing: the folder for the results")
    from kbot.sweep.processes import Processes
    from kbot.sweep.runner import checked_plan, opened_sweep
    from kbot.sweep.summary import summary
    from kbot.trials.pool import Pool

    request = _request(words, choice)
    begun = time.monotonic()
    with Pool(running.jobs) as pool:
        with busy(f"preparing {request.robot}"):
            plan = checked_plan(request, pool, confirmed=running.confirmed)
        with opened_sweep(plan, running.out) as sweep:
            if sweep.journal.count and sweep.missing:
                print_note(f"continuing: {sweep.journal.count} of {plan.runs} runs are finished")
            is_complete = True
            with (
                counting("running", sweep.missing) as advance,
                Processes(pool, running.limit_time) as executor,
            ):
                try:
                    sweep.run(executor, advance)
                except KeyboardInterrupt:
                    is_complete = False
            if as_json:
                print_json(sweep.to_json())
            else:
                click.echo(summary(sweep, time.monotonic() - begun))
            if not is_complete:
                print_note("interrupted. The same command continues the sweep")
                return INTERRUPTED
            return COMPLETE if sweep.has_passed else ALL_FAILED


def _request(words: tuple[str, ...], choice: _Choice) -> Request:
    from kbot.sweep.designs import Method
    from kbot.sweep.preparation import Request

    file, values = file_and_arguments(words)
    return Request(
        robot=file,
        dimensions=choice.dimensions,
        scenarios=choice.scenarios,
        objectives=choice.objectives,
        method=Method(choice.method),
        runs=choice.runs,
        values=values,
        packages=choice.package_path,
    )
