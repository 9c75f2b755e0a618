"""Every fault that is put into a clean robot is reported with its code at its line. Clean robots have
none."""

from __future__ import annotations

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

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


@st.composite
def generated(draw: st.DrawFn) -> Rover:
    """A rover of 20 cm to 1 m and up to 100 kg with any drive, in proportions with which it stands and
    drives."""
    length = draw(st.floats(0.2, 1.0))
    width, height = length * draw(st.floats(0.65, 0.85)), length * draw(st.floats(0.2, 0.26))
    radius = length * draw(st.floats(0.12, 0.21))
    return Rover(
        "generated",
        round(length, 4),
        round(width, 4),
        round(height, 4),
        round(radius, 4),
        round(radius * draw(st.floats(0.4, 0.55)), 4),
        round(draw(st.floats(200.0, min(900.0, 100.0 / (length * width * height)))), 1),
        draw(st.sampled_from(["classic", "gz", "ros2_control"])),
    )


@settings(max_examples=100)
@given(generated())
def test_a_generated_robot_has_no_findings(robot: Rover) -> None:
    assert check_text(rover(robot), "generated.xacro", config=Config()) == ()


@settings(max_examples=300)
@given(generated(), st.sampled_from(MUTATORS))
def test_a_mutant_of_a_generated_robot_is_found_at_its_line(robot: Rover, mutator: Mutator) -> None:
    spoiled = mutator.spoil(rover(robot))
    if spoiled is not None:  # None for a fault of a drive that this robot does not have
        text, line = spoiled
        found = check_text(text, "generated.xacro", config=Config())
        assert (mutator.code, line) in {(d.code, d.origin.span.line) for d in found if d.origin}
