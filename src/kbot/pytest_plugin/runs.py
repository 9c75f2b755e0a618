"""The runs of a test: trials, and what a report shows about the run of a test that fails."""

from __future__ import annotations

import re
import traceback
from collections.abc import Callable, Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

import pytest

from kbot.brief import Brief
from kbot.pytest_plugin.settings import lines_of, start_of, without_traceback

if TYPE_CHECKING:
    import os

    from kbot.model import RobotModel
    from kbot.trials.expectations import Expectation
    from kbot.trials.results import TrialResult
    from kbot.trials.scenario import Condition, Program, Scenario, Step
    from kbot.world import World

RUN: pytest.StashKey[Callable[[bool], tuple[TrialResult, World]]] = pytest.StashKey()
"""Describes the last run of a test. The argument is whether the test failed, which needs a film."""
FAILED: pytest.StashKey[bool] = pytest.StashKey()
_KBOT = Path(__file__).parents[1]
_LONGEST_NAME = 120
"""Characters of a file name that is made from a test's name."""


class Trial(Brief):
    """The type of the fixture `trial`."""

    def __init__(
        self, item: pytest.Item, robot: RobotModel | str | os.PathLike[str], world: str | World, seed: int
    ) -> None:
        self._item, self._robot, self._world, self._seed = item, robot, world, seed

    def __call__(
        self,
        steps: Sequence[Step] = (),
        expect: Sequence[Expectation] = (),
        duration: float = 10.0,
        *,
        until: Condition | None = None,
        programs: Sequence[Program] = (),
    ) -> TrialResult:
        """Run a scenario with the test's robot, world, seed and start. Returns the result with its trace.

        The arguments are those of `kbot.trials.Scenario`. The test fails if the run does not keep an
        expectation or cannot be completed. The failure has all reasons.
        """
        __tracebackhide__ = True
        from kbot.sim.preparation import read_robot
        from kbot.trials.scenario import Scenario

        with without_traceback():
            if not isinstance(self._world, str):
                pytest.fail("the fixture trial needs the name or the file of a world, not a World", False)
            scenario = Scenario(
                self._item.name,
                duration,
                steps,
                expect,
                world=self._world,
                start=start_of(self._item),
                seeds=(self._seed,),
                until=until or {},
                programs=programs,
            )
            robot = read_robot(self._robot)
        result = run_scenario(self._item, scenario, self._seed, robot)
        if not result.passed:
            pytest.fail(reasons(result))
        return result


def run_scenario(
    item: pytest.Item, scenario: Scenario, seed: int, robot: RobotModel | None = None
) -> TrialResult:
    """Run a scenario for a test. A run that fails is repeated for a film and a recording."""
    from kbot.trials.films import run_filmed
    from kbot.trials.trial import run_trial
    from kbot.world import load_world

    result = run_trial(scenario, seed, robot, with_trace=True)
    if result.trace is not None:
        if not result.passed and is_filmed(item):
            result = run_filmed(scenario, seed, robot, record=recording_of(item))
        world = load_world(scenario.world_of(seed))
        item.stash[RUN] = lambda failed: (result, world)
    return result


def reasons(result: TrialResult) -> str:
    """Why a trial failed, a line for each reason."""
    return "\n".join(filter(None, (result.error, *result.failures)))


def is_filmed(item: pytest.Item) -> bool:
    """Whether a report shows a film of the run if the test fails."""
    return bool(item.config.option.kbot_film or item.config.option.kbot_html)


def recording_of(item: pytest.Item) -> str:
    """The file of a recording with `--kbot-film`, or else an empty text."""
    return str(_file(item, ".mcap")) if item.config.option.kbot_film else ""


def cut_traceback(call: pytest.CallInfo[None]) -> str:
    """Cut KBot's own calls off the traceback of an error that KBot raised. Returns its source lines."""
    from kbot.text import KbotError

    raised = call.excinfo
    if raised is None or not isinstance(raised.value, KbotError):
        return ""
    callers = [
        frame
        for frame, _ in traceback.walk_tb(raised.tb)
        if not Path(frame.f_code.co_filename).is_relative_to(_KBOT)
    ]
    entry = raised.tb
    while entry.tb_next is not None and entry.tb_frame is not callers[-1]:
        entry = entry.tb_next
    entry.tb_next = None
    return lines_of(raised.value)


def describe(item: pytest.Item, report: pytest.TestReport) -> TrialResult:
    """The last run of a test. If the test failed, its report gets the sections about the run."""
    from kbot.trials.failure_report import path_picture, sections
    from kbot.trials.reports.table import replay_command

    result, world = item.stash[RUN](report.failed)
    if not report.failed:
        return result
    if result.passed:  # another assertion failed after the run
        end = None if result.trace is None else float(result.trace["time"][-1])
        result = replace(result, error=_message(report), failed_at=end)
    picture = _file(item, ".png")
    picture.write_bytes(path_picture(result, world))
    files = [f"picture of the path: {picture}"]
    if result.film and item.config.option.kbot_film:
        film = picture.with_suffix(".webp")
        film.write_bytes(result.film)
        files.append(f"film: {film}")
    elif result.film_problem:
        files.append(f"no film: {result.film_problem}")
    if result.recording:
        files.append(f"recording: {replay_command(result)}")
    report.sections += [*sections(result), ("KBot: files of the run", "\n".join(files))]
    return result


def without_run(item: pytest.Item, report: pytest.TestReport) -> TrialResult:
    """The result of a test that failed before its run began, such as one whose robot does not load."""
    from kbot.trials.results import TrialResult

    return TrialResult(item.name, 0, error=_message(report))


def _message(report: pytest.TestReport) -> str:
    """The first line about a failure."""
    crash = getattr(report.longrepr, "reprcrash", None)
    text = str(report.longrepr) if crash is None else str(crash.message)
    return text.strip().partition("\n")[0]


def _file(item: pytest.Item, suffix: str) -> Path:
    """A new file in the folder of `--kbot-film`, or in pytest's folder for temporary files."""
    if item.config.option.kbot_film:
        folder = Path(item.config.option.kbot_film)
    else:
        # the factory of the fixture tmp_path_factory: items of scenario files have no fixtures
        factory: pytest.TempPathFactory = item.config._tmp_path_factory  # type: ignore[attr-defined]
        folder = factory.mktemp("kbot")
    name = re.sub(r"[^\w.-]+", "-", item.nodeid).strip("-")[-_LONGEST_NAME:]
    file = folder / f"{name}{suffix}"
    file.unlink(missing_ok=True)
    return file
