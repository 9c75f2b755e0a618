"""Films of trials: the last seconds of a run, and two robots in the same scenario side by side."""

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
"""Seconds of a film before the end of the run."""


def run_filmed(
    scenario: Scenario,
    seed: int = 0,
    robot: RobotModel | None = None,
    *,
    last_seconds: float = SECONDS,
    with_all_values: bool = False,
    record: str = "",
) -> TrialResult:
    """Run a scenario as `run_trial` does, equal bit for bit, and keep its trace and a film of its end.

    Without off-screen OpenGL, the result's `film_problem` says what to install.
    """
    result, moments = _run_taped(scenario, seed, robot, last_seconds, with_all_values, record)
    if not moments:
        return result  # the run did not start
    try:
        return replace(result, film=draw_film(moments))
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
    """Run a scenario and return a film of its last seconds. `kind` is WEBP, GIF or PNG.

    Raises:
        KbotError: the scenario cannot run, or off-screen OpenGL is not available.
    """
    return draw_film(_moments(scenario, seed, robot, last_seconds), look, kind)


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
    """Run a scenario with two robots and return a film of both, side by side.

    Raises:
        KbotError: the scenario cannot run, or off-screen OpenGL is not available.
    """
    runs = [_moments(scenario, seed, robot, last_seconds) for robot in (before, after)]
    return draw_side_by_side(runs[0], runs[1], titles, look, kind)


def _moments(
    scenario: Scenario, seed: int, robot: RobotModel | None, last_seconds: float
) -> tuple[Moment, ...]:
    result, moments = _run_taped(scenario, seed, robot, last_seconds, with_all_values=False, record="")
    if not moments:
        raise KbotError(result.error)
    return moments


def _run_taped(
    scenario: Scenario,
    seed: int,
    robot: RobotModel | None,
    last_seconds: float,
    with_all_values: bool,
    record: str,
) -> tuple[TrialResult, tuple[Moment, ...]]:
    tapes: list[Tape] = []

    def watch(simulation: Simulation) -> None:
        tapes.append(Tape(simulation, last_seconds))

    result = run_trial(
        scenario, seed, robot, with_all_values=with_all_values, with_trace=True, record=record, watch=watch
    )
    return result, tapes[0].moments if tapes else ()
