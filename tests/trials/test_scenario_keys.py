"""Values of a scenario that are replaced by the path of their key."""

from __future__ import annotations

from dataclasses import replace

import pytest

from kbot.kinematics.planar_pose import PlanarPose
from kbot.sim.injected_faults import Payload
from kbot.text import KbotError
from kbot.trials import (
    Bound,
    Check,
    Command,
    InjectFault,
    JointCommand,
    Program,
    Push,
    Range,
    Reaches,
    Scenario,
    Step,
)
from kbot.trials.scenario_keys import unit_of_key, with_key, with_keys

STEPS = (
    Step(Command(0.2), 0.5),
    Step(Push((1.0, 2.0, 3.0), 0.1), when={"x": Range(0.1)}),
    Step(InjectFault(Payload("base_link", 1.0), 3.0)),
    Step(JointCommand({"lift": 0.1})),
)
EXPECT = (Bound("path_length", 1.0), Reaches(1.0, 2.0, 0.1))
SCENARIO = Scenario("drive", 5.0, STEPS, EXPECT)


def with_step(index: int, step: Step) -> Scenario:
    return replace(SCENARIO, steps=(*STEPS[:index], step, *STEPS[index + 1 :]))


@pytest.mark.parametrize(
    ("path", "value", "expected"),
    [
        ("duration", 3, replace(SCENARIO, duration=3.0)),
        ("steps.0.linear", 0.5, with_step(0, Step(Command(0.5), 0.5))),
        ("steps.0.command.linear", 0.5, with_step(0, Step(Command(0.5), 0.5))),
        ("steps.0.at", 0.7, with_step(0, Step(Command(0.2), 0.7))),
        ("steps.1.push.force.2", 7, with_step(1, replace(STEPS[1], action=Push((1.0, 2.0, 7.0), 0.1)))),
        ("steps.1.when.x.min", 0.4, with_step(1, replace(STEPS[1], when={"x": Range(0.4)}))),
        ("steps.2.fault.mass", 4, with_step(2, Step(InjectFault(Payload("base_link", 4.0), 3.0)))),
        ("steps.2.fault.duration", 4, with_step(2, Step(InjectFault(Payload("base_link", 1.0), 4.0)))),
        ("steps.3.joints.lift", 0.2, with_step(3, Step(JointCommand({"lift": 0.2})))),
        (
            "expect.0.path_length.max",
            4,
            replace(SCENARIO, expect=(Bound("path_length", 1.0, 4.0), EXPECT[1])),
        ),
        ("expect.0.max", 4, replace(SCENARIO, expect=(Bound("path_length", 1.0, 4.0), EXPECT[1]))),
        ("expect.1.within", 0.3, replace(SCENARIO, expect=(EXPECT[0], Reaches(1.0, 2.0, 0.3)))),
    ],
)
def test_a_value_is_replaced(path: str, value: float, expected: Scenario) -> None:
    assert with_key(SCENARIO, path, value) == expected


@pytest.mark.parametrize(
    ("path", "unit"),
    [
        ("duration", "s"),
        ("start.yaw", "rad"),
        ("steps.0.linear", "m/s"),
        ("steps.0.command.angular", "rad/s"),
        ("steps.0.at", "s"),
        ("steps.1.push.force.2", "N"),
        ("steps.1.torque.0", "N m"),
        ("steps.1.when.x.min", "m"),
        ("steps.2.fault.mass", "kg"),
        ("steps.2.fault.at.0", "m"),
        ("steps.2.fault.duration", "s"),
        ("steps.3.joints.lift", ""),  # depends on the joint
        ("expect.0.path_length.max", "m"),
        ("expect.1.yaw_within", "rad"),
        ("expect.0.measure", ""),
        ("expect.2.min", "J/m"),
        ("expect.2.name", ""),
        ("until.tilt.max", "rad"),
        ("programs.0.time_limit", "s"),
    ],
)
def test_the_unit_of_a_value(path: str, unit: str) -> None:
    scenario = replace(
        SCENARIO,
        start=PlanarPose(),
        expect=(*EXPECT, Check("cost", lambda trace: 0.0, min=1.0, unit="J/m")),
        until={"tilt": Range(max=1.0)},
        programs=(Program("drive.py"),),
    )
    assert unit_of_key(scenario, path) == unit


def test_several_values_are_replaced() -> None:
    found = with_keys(SCENARIO, {"duration": 6.0, "steps.0.angular": 1.0})
    assert found == replace(with_step(0, Step(Command(0.2, 1.0), 0.5)), duration=6.0)


@pytest.mark.parametrize(
    ("path", "value", "error"),
    [
        ("durations", 3, "scenario.durations = 3: there is no 'durations': did you mean 'duration'?"),
        ("steps.0.liner", 1, "scenario.steps.0.liner = 1: there is no 'liner': did you mean 'linear'?"),
        ("steps.9.at", 1, "scenario.steps.9.at = 1: '9' is not the index of one of 4 items: the first is 0"),
        ("steps.last.at", 1, "scenario.steps.last.at = 1: 'last' is not the index of one of 4 items"),
        ("duration", "long", "scenario.duration = long: expected a number"),
        ("duration", -1, "scenario.duration = -1: the duration in seconds must be a finite number above 0"),
        ("steps", 3, "scenario.steps = 3: it is not a single value. Add the key"),
        ("until.x.min", 3, "scenario.until.x.min = 3: there is no 'x': the scenario has none"),
        ("start.x", 3, "scenario.start.x = 3: there is no 'x': the scenario does not give"),
        ("seeds", 3, "scenario.seeds cannot be replaced. Use --set seed=…"),
    ],
)  # fmt: skip
def test_errors(path: str, value: float | str, error: str) -> None:
    with pytest.raises(KbotError) as raised:
        with_key(SCENARIO, path, value)
    assert str(raised.value).startswith(error)
