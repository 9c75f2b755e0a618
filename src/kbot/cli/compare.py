"""`kbot compare`: report how two robots, or two versions of one, behave differently, and why."""

from __future__ import annotations

from collections.abc import Sequence
from contextlib import ExitStack
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import click

from kbot.cli.arguments import (
    examples,
    jobs_option,
    json_option,
    output_file,
    package_path_option,
    split_arguments,
)
from kbot.cli.output import print_json, unwritten_reported
from kbot.cli.progress import busy
from kbot.text.errors import KbotError
from kbot.text.files import write_bytes, write_text

if TYPE_CHECKING:
    from kbot.model import RobotModel
    from kbot.trials.compare.comparison import Comparison
    from kbot.trials.scenario_file import FoundScenario


@click.command(
    "compare",
    epilog=examples(
        ("kbot compare old.xacro new.xacro", "two files"),
        ("kbot compare HEAD~1: .", "a package before its last commit"),
        ("kbot compare old.mcap new.mcap", "two recordings"),
        "kbot compare main:urdf/robot.xacro urdf/robot.xacro",
        "kbot compare main: . --scenario drive.scenario.yaml --markdown change.md",
    ),
)
@click.argument("words", nargs=-1, metavar="A B [name:=value ...]")
@click.option(
    "--scenario",
    "scenarios",
    multiple=True,
    metavar="FILE",
    type=click.Path(exists=True),
    help="Scenario file, or folder of scenario files, to run. Can be repeated.",
)
@click.option(
    "--battery",
    "batteries",
    multiple=True,
    metavar="NAME",
    show_default="all, if there is no --scenario",
    help="Battery to run. Can be repeated. `kbot try --list` lists them.",
)
@jobs_option
@click.option(
    "--markdown",
    callback=output_file(),
    metavar="FILE",
    help="Write the report as Markdown, for a pull request.",
)
@click.option(
    "--film",
    callback=output_file(".webp", ".gif"),
    metavar="FILE",
    help="Write a film (.webp or .gif) of the scenario that changed most, before and after.",
)
@click.option("--show", is_flag=True, help="Then show both robots side by side in the browser.")
@click.option("-v", "--verbose", is_flag=True, help="List all changed measures and settings.")
@json_option
@package_path_option
def command(
    words: tuple[str, ...],
    scenarios: tuple[str, ...],
    batteries: tuple[str, ...],
    jobs: int | None,
    markdown: str | None,
    film: str | None,
    show: bool,
    verbose: bool,
    as_json: bool,
    package_path: tuple[str, ...],
) -> int:
    """Compare how two robots behave, and find the edited lines that explain a change.

    A and B are robot files, packages, recordings, or git revisions: REVISION:PATH is a file or folder of a
    revision, and REVISION: the package in the current folder. name:=value applies to both.

    The scenarios are made for A and run with both robots. A change counts if it exceeds the floor of its
    measure and its spread between seeds. Each difference of a declared sensor, topic or frame counts.

    Exit status: 0 the robots behave the same; 1 they do not; 2 unusable input.
    """
    from kbot.trials.compare.comparison import NO_RESULT, to_markdown, to_text

    with ExitStack() as stack:
        try:
            with unwritten_reported(markdown, film):
                comparison, pair = _compare(words, scenarios, batteries, jobs, package_path, stack)
            if pair is None and (film is not None or show):
                raise KbotError("--film and --show need robots. To see a recording, use kbot view FILE")
        except (Exception, KeyboardInterrupt):
            if as_json:
                print_json(NO_RESULT)
            raise
        if as_json:
            print_json(comparison.to_json())
        else:
            click.echo(to_text(comparison, all_rows=verbose))
        if markdown is not None:  # after the result, which is not lost if the file cannot be written
            write_text(markdown, to_markdown(comparison))
        if pair is not None and film is not None:
            with unwritten_reported(film):
                _film(pair, comparison, film)
        if pair is not None and show:
            _show(pair, comparison)
    return 1 if comparison.is_changed else 0


@dataclass(frozen=True, slots=True)
class _Pair:
    """Both robots, whose files exist until the command ends, and the scenarios for them."""

    before: RobotModel
    after: RobotModel
    scenarios: Sequence[FoundScenario]


def _compare(
    words: tuple[str, ...],
    scenarios: tuple[str, ...],
    batteries: tuple[str, ...],
    jobs: int | None,
    package_path: tuple[str, ...],
    stack: ExitStack,
) -> tuple[Comparison, _Pair | None]:
    """Compare robots or recordings. Revisions are extracted until `stack` is closed."""
    from kbot.trials.compare.edits import Edits
    from kbot.trials.compare.recorded import compare_recordings
    from kbot.trials.compare.revisions import RecordingFile, opened
    from kbot.trials.compare.run import compare
    from kbot.trials.pool import Pool
    from kbot.trials.selection import ALL, scenarios_for

    names, values = split_arguments(words)
    if len(names) != 2:
        raise KbotError(f"expected two robots or recordings, A and B, not {len(names)}")
    before, after = (stack.enter_context(opened(name, values, package_path)) for name in names)
    if isinstance(before, RecordingFile) and isinstance(after, RecordingFile):
        return compare_recordings(before.name, after.name), None
    if isinstance(before, RecordingFile) or isinstance(after, RecordingFile):
        raise KbotError("a recording can only be compared with a recording")
    with busy(f"loading {names[0]} and {names[1]}") as describe, Pool(jobs) as pool:
        edits = Edits(before, after)
        chosen = scenarios_for(pool, edits.before, [*scenarios, *batteries] or [ALL])
        if pool.interrupted:
            raise KeyboardInterrupt

        def progress(done: int, count: int) -> None:
            describe(f"{done} of {count} trials")

        comparison = compare(before, after, edits, chosen, pool, progress)
    return comparison, _Pair(edits.before, edits.after, chosen)


def _film(pair: _Pair, comparison: Comparison, path: str) -> None:
    """Film the scenario that changed most, or the first one."""
    from kbot.trials.films import film_before_and_after

    names = [d.scenario for d in comparison.significant] or [pair.scenarios[0].scenario.name]
    scenario = next(each for each in pair.scenarios if each.scenario.name == names[0]).whole()
    kind = Path(path).suffix[1:].upper()
    with busy("drawing the film"):
        titles = f"{scenario.name}, before", f"{scenario.name}, after"
        film = film_before_and_after(
            scenario, scenario.seeds[0], pair.before, pair.after, titles=titles, kind=kind
        )
    write_bytes(path, film)


def _show(pair: _Pair, comparison: Comparison) -> None:
    """Show both robots in the browser until Ctrl-C."""
    from kbot.trials.compare.side_by_side import SideBySide, choose_scenario

    both = SideBySide(
        pair.before, pair.after, choose_scenario([each.whole() for each in pair.scenarios], comparison)
    )
    with both.simulation.serve() as page:
        both.drive()
        page.wait()
