"""Tests the ticks of the axes of a sweep's report."""

from __future__ import annotations

import pytest

from kbot.sweep.report.charts import axis, parallel_svg
from kbot.sweep.space import Value, parse_dimension


def ticks(text: str, values: list[Value]) -> list[str]:
    """The ticks of an axis with room for ten texts."""
    return [shown for _, shown in axis("", values, parse_dimension(text)).ticks(5, lambda _: 0.1)]


@pytest.mark.parametrize(
    ("dimension", "values", "expected"),
    [
        ("a=3,1,2", [1, 2, 3], ["1", "2", "3"]),
        ("a=0.01,0.1,0.015", [0.01, 0.015, 0.1], ["0.01", "0.1"]),  # without room for 0.015
        ("a=0.7,0.1,0.4", [0.1, 0.4, 0.7], ["0.1", "0.4", "0.7"]),
        ("a=0.03:0.05:4", [0.03, 0.05], ["0.03", "0.0366667", "0.0433333", "0.05"]),
        ("a=1:13:4", [1, 5, 9, 13], ["1", "5", "9", "13"]),
        ("a=1:2", [1, 2], ["1", "2"]),
        ("a=1:1000", [4, 5], ["4", "5"]),
        ("a=0:40", [0, 40], ["0", "10", "20", "30", "40"]),
        ("a=1:3", [2], ["2"]),  # the only one that ran
        ("a=0.0:1.0", [0.1, 0.9], ["0.2", "0.4", "0.6", "0.8"]),
        ("a=up,down", ["up"], ["up", "down"]),
    ],
)
def test_ticks_are_at_the_values_if_they_are_few_or_integers(
    dimension: str, values: list[Value], expected: list[str]
) -> None:
    assert ticks(dimension, values) == expected


def test_a_tick_is_at_its_value() -> None:
    found = axis("", [1, 2, 4], parse_dimension("a=1,2,4"))
    assert found.ticks(5, lambda _: 0.1) == [(found.at(value), str(value)) for value in (1, 2, 4)]


def test_a_long_label_keeps_its_unit() -> None:
    axes = [axis(label, [0.0, 1.0]) for label in ("scenario.steps.12.push.force.0 [N]", "energy [J]")]
    svg = parallel_svg(axes, [])
    assert ">….12.push.force.0 [N]</text>" in svg
    assert ">energy [J]</text>" in svg
