"""The moment of a failure, against the closed form of the motion."""

from __future__ import annotations

import pytest

from kbot.trials import (
    AddObject,
    Bound,
    Command,
    NeverTouches,
    Reaches,
    RobotSource,
    Scenario,
    Step,
    run_trial,
)
from kbot.trials.expectations import Expectation


@pytest.mark.parametrize(
    ("expectation", "time"),
    [
        # 0.2 m/s from the start: 0.5 m after 2.5 s, besides the acceleration
        (Bound("final_forward", max=0.5), 2.5),
        (Bound("path_length", max=0.9), 4.5),
        # a place that is left after 0.4 m, and one that is never reached
        (Reaches(0.4, 0.0, within=0.1), 2.5),
        (Reaches(5.0, 0.0, within=0.1), 6.0),
        (Bound("final_left", min=1.0), 6.0),
    ],
)
def test_it_is_the_last_time_at_which_the_expectation_was_fulfilled(
    expectation: Expectation, time: float
) -> None:
    steps = [Step(Command(0.2))]
    result = run_trial(Scenario("drive", 6.0, steps, [expectation], RobotSource("kbot")))
    assert result.failed_at == pytest.approx(time, abs=0.3)


def test_it_is_the_touch_and_the_earliest_of_several() -> None:
    steps = [Step(AddObject("wall", 1.0, 0.0, size=(0.1, 1.0, 0.5))), Step(Command(0.2))]
    expect = [NeverTouches(), Reaches(2.0, 0.0, within=0.1)]
    result = run_trial(Scenario("wall", 8.0, steps, expect, RobotSource("kbot")), with_trace=True)
    assert result.trace is not None
    (touch,) = (event.time for event in result.trace.events if event.kind == "touch")
    assert result.failed_at == pytest.approx(touch, abs=0.15)


def test_a_passed_trial_has_none() -> None:
    scenario = Scenario("rest", 0.1, expect=[Bound("max_speed", max=1.0)], robot=RobotSource("kbot"))
    assert run_trial(scenario).failed_at is None
