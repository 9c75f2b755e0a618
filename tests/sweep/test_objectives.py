"""Objectives: their texts, and the designs that are best in several of them."""

from __future__ import annotations

import math

import pytest

from kbot.sweep.objectives import Objective, front, parse_objective, parse_objectives
from kbot.text import KbotError


def test_an_objective_is_minimised_by_default() -> None:
    assert parse_objective("energy") == Objective("energy")
    assert parse_objective("energy:min") == Objective("energy")
    assert parse_objective("path_length:max") == Objective("path_length", is_maximum=True)
    assert parse_objective("support/left_wheel:max") == Objective("support/left_wheel", is_maximum=True)
    assert parse_objective("wheel_radius", ["wheel_radius"]) == Objective("wheel_radius")


@pytest.mark.parametrize(
    ("text", "error"),
    [
        ("enrgy", "--objective enrgy: unknown measure 'enrgy': did you mean 'energy'?"),
        ("energy:least", "--objective energy:least: the direction is min or max, not 'least'"),
        (
            "energy:maximise",
            "--objective energy:maximise: the direction is min or max, not 'maximise'",
        ),
        ("-energy", "--objective -energy: to maximise energy, write energy:max"),
    ],
)
def test_errors_of_a_text(text: str, error: str) -> None:
    with pytest.raises(KbotError) as raised:
        parse_objective(text)
    assert str(raised.value) == error


def test_an_objective_is_given_once() -> None:
    with pytest.raises(KbotError, match="--objective energy is given twice"):
        parse_objectives(["energy", "energy:max"])


def test_the_front_of_one_objective_has_the_best_designs() -> None:
    costs = {0: (3.0,), 1: (1.0,), 2: (math.nan,), 3: (1.0,)}
    assert front([Objective("energy")], costs) == [1, 3]
    assert front([Objective("energy", is_maximum=True)], costs) == [0]


def test_the_front_of_two_objectives_has_what_no_other_design_dominates() -> None:
    # 4 is dominated by 1 (cheaper, as far), and 3 by 0 (as cheap, further)
    values = {0: (1.0, 1.0), 1: (2.0, 3.0), 2: (4.0, 5.0), 3: (1.0, 0.5), 4: (3.0, 3.0), 5: (math.nan, 9.0)}
    assert front([Objective("energy"), Objective("path_length", is_maximum=True)], values) == [0, 1, 2]
