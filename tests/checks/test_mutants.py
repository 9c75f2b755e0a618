"""Every fault sown into a clean robot is found, with its code and at its line; clean robots have none."""

from __future__ import annotations

import pytest

from kbot.checks import check_text
from kbot.checks.config import Config

from .mutators import MUTATORS, Mutator
from .robots import ROVERS, Rover, rover

MUTANTS = [
    pytest.param(mutator, robot, id=f"{mutator.code}-{mutator.name}-{robot.name}")
    for mutator in MUTATORS
    for robot in ROVERS
    if mutator.spoil(rover(robot))
]


@pytest.mark.parametrize("robot", ROVERS, ids=lambda r: r.name)
def test_a_clean_robot_has_no_findings(robot: Rover) -> None:
    assert check_text(rover(robot), f"{robot.name}.xacro", config=Config()) == ()


@pytest.mark.parametrize(("mutator", "robot"), MUTANTS)
def test_a_mutant_is_found_at_its_line(mutator: Mutator, robot: Rover) -> None:
    spoiled = mutator.spoil(rover(robot))
    assert spoiled is not None
    text, line = spoiled
    found = check_text(text, f"{robot.name}.xacro", config=Config())
    assert (mutator.code, line) in {(d.code, d.origin.span.line) for d in found if d.origin}


def test_every_mutator_spoils_some_robot() -> None:
    assert len(MUTATORS) >= 60
    for mutator in MUTATORS:
        assert any(mutator.spoil(rover(robot)) for robot in ROVERS), mutator.name
