"""Films of trials: the seconds around a failure, and two robots in the same scenario side by side."""

from __future__ import annotations

from dataclasses import replace

from kbot.model import RobotModel
from kbot.render.film import LOOK, Moment, Tape, draw_film, draw_side_by_side
from kbot.render.look import Look
from kbot.sim import Simulation
from kbot.text import KbotError
from kbot.trials.results import TrialResult
from kbot.trials.scenario import Scenario
from kbot.trials.trial import run_trial

SECONDS = 5.0
"""Seconds of a film."""
_AFTER = 1.0
"""Seconds of a film after the failure. The others are before it."""


def run_filmed(
    scenario: Scenario,
    seed: int = 0,
    robot: RobotModel | None = None,
    *,
    last_seconds: float = SECONDS,
    with_all_values: bool = False,
    record: str = "",
) -> TrialResult:
    """Run a scenario as `run_trial` does, equal bit for bit, and keep its trace and a film.

    The film shows `last_seconds` until shortly after the failure, or until the end of a run that passed.
    Without off-screen OpenGL, the result's `film_problem` names the package to install.
    """
    result, moments = _run_taped(
        scenario, seed, robot, scenario.duration, with_all_values=with_all_values, record=record
    )
    if not moments:
        return result  # the run did not start
    try:
        return replace(result, film=draw_film(_around(moments, result.failed_at, last_seconds)))
    except KbotError as error:
        return replace(result, film_problem=str(error))


def film_of(
    scenario: Scenario,
    seed: int = 0,
    robot: RobotModel | None = None,
    last_seconds: float = SECONDS,
    look: Look = LOOK,
    kind: str = "WEBP",
) -> bytes:
    """Run a scenario and return a film, as `run_filmed` does. `kind` is WEBP, GIF or PNG.

    Raises:
        KbotError: the scenario cannot run, or off-screen OpenGL is not available.
    """
    result, moments = _run_taped(scenario, seed, robot, scenario.duration)
    if not moments:
        raise KbotError(result.error)
    return draw_film(_around(moments, result.failed_at, last_seconds), look, kind)


def film_before_and_after(
    scenario: Scenario,
    seed: int,
    before: RobotModel,
    after: RobotModel,
    last_seconds: float = SECONDS,
    titles: tuple[str, str] = ("before", "after"),
    look: Look = LOOK,
    kind: str = "WEBP",
) -> bytes:
    """Run a scenario with two robots and return a film of the last seconds of both, side by side.

    Raises:
        KbotError: the scenario cannot run, or off-screen OpenGL is not available.
    """
    runs = []
    for robot in (before, after):
        result, moments = _run_taped(scenario, seed, robot, last_seconds)
        if not moments:
            raise KbotError(result.error)
        runs.append(moments)
    return draw_side_by_side(runs[0], runs[1], titles, look, kind)


def _around(moments: tuple[Moment, ...], failed_at: float | None, seconds: float) -> tuple[Moment, ...]:
    """The moments before a failure and shortly after it, or the last ones."""
    end = moments[-1].time
    if failed_at is not None and failed_at + _AFTER >= moments[0].time + seconds:
        end = min(end, failed_at + _AFTER)
    elif failed_at is not None and moments[0].time == 0.0:
        end = min(end, seconds)  # a failure in the first seconds
    # half a period: the times of moments are not exact
    return tuple(moment for moment in moments if end - seconds - 0.05 < moment.time < end + 0.05)


def _run_taped(
    scenario: Scenario,
    seed: int,
    robot: RobotModel | None,
    seconds: float,
    *,
    with_all_values: bool = False,
    record: str = "",
) -> tuple[TrialResult, tuple[Moment, ...]]:
    tapes: list[Tape] = []

    def watch(simulation: Simulation) -> None:
        tapes.append(Tape(simulation, seconds))

    result = run_trial(
        scenario, seed, robot, with_all_values=with_all_values, with_trace=True, record=record, watch=watch
    )
    return result, tapes[0].moments if tapes else ()
