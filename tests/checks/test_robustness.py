"""Checking a file with any content ends with findings and never with an exception."""

from __future__ import annotations

import re
from pathlib import Path

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from kbot.checks import check_file, check_text
from kbot.checks.config import Config

from .robots import ROVERS, rover

TEXT = rover(ROVERS[0])
LINES = TEXT.split("\n")
VALUES = re.compile(r'="([^"]*)"')


@pytest.mark.parametrize("number", range(len(LINES)))
def test_checking_a_robot_without_one_of_its_lines_does_not_raise(number: int) -> None:
    text = "\n".join(LINES[:number] + LINES[number + 1 :])
    for diagnostic in check_text(text, "rover.xacro", config=Config()):
        assert diagnostic.message
        assert diagnostic.origin is None or diagnostic.origin.span.line >= 1


ODD = (
    "",
    "nan",
    "inf",
    "-1",
    "0",
    "1e308",
    "1e-308",
    "0 0 0",
    "a b",
    "${radius",
    "${1/0}",
    "$(arg x)",
    "é",
    "1 2",
)


@settings(max_examples=150, deadline=None, suppress_health_check=[HealthCheck.too_slow])
@given(at=st.integers(0, len(VALUES.findall(TEXT)) - 1), value=st.sampled_from(ODD))
def test_checking_a_robot_with_an_odd_value_does_not_raise(at: int, value: str) -> None:
    match = list(VALUES.finditer(TEXT))[at]
    text = TEXT[: match.start(1)] + value + TEXT[match.end(1) :]
    check_text(text, "rover.xacro", config=Config())


@settings(max_examples=100, deadline=None)
@given(st.text(max_size=200))
def test_checking_any_text_does_not_raise(text: str) -> None:
    check_text(text, "any.xacro", config=Config())
    check_text("<robot name='r'>" + text + "</robot>", "any.xacro", config=Config())


def test_checking_published_robots_does_not_raise(shared: Path) -> None:
    files = [
        path
        for path in sorted((shared / "corpus" / "src").rglob("*"))
        if path.name.endswith((".xacro", ".urdf", ".launch", ".launch.xml"))
    ]
    assert len(files) > 300
    for path in files:
        for diagnostic in check_file(str(path), config=Config()):
            assert diagnostic.message
