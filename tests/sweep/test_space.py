"""What varies: the texts of `--set`, and the values that they mean."""

from __future__ import annotations

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from kbot.sweep.space import Choices, Dimension, Interval, Levels, Target, parse_dimension, parse_space
from kbot.text import KbotError


def values(text: str) -> list[object]:
    domain = parse_dimension(text).domain
    assert not isinstance(domain, Interval)
    return [domain.nth(index) for index in range(domain.count)]


@pytest.mark.parametrize(
    ("text", "expected", "kind"),
    [
        ("r=0.02:0.05:7", [0.02, 0.025, 0.03, 0.035, 0.04, 0.045, 0.05], float),
        ("x=-0.08,-0.06", [-0.08, -0.06], float),
        ("n=3:7:5", [3, 4, 5, 6, 7], int),
        ("n=0:1:3", [0, 0.5, 1], float),
        ("n=2:4", [2, 3, 4], int),
        ("n=1,2.5", [1.0, 2.5], float),
        ("seed=0:3", [0, 1, 2, 3], int),
        ("name=left,right", ["left", "right"], str),
        ("mesh=package://a/b.stl", ["package://a/b.stl"], str),
        ("world=empty,stairs:steps=2,height=0.01,maze", ["empty", "stairs:steps=2,height=0.01", "maze"], str),
        ("one=5:5:1", [5], int),
    ],
)
def test_values_of_a_text(text: str, expected: list[object], kind: type) -> None:
    assert values(text) == expected
    assert parse_dimension(text).kind is kind


@pytest.mark.parametrize(
    ("text", "error"),
    [
        ("wheel_radius", "'wheel_radius' is not NAME=VALUES, for example wheel_radius=0.02:0.05:7"),
        ("r=", "--set r=: there are no values"),
        ("r=0.05:0.02:7", "--set r=0.05:0.02:7: the range is empty: 0.05 is above 0.02"),
        ("r=0:inf:7", "--set r=0:inf:7: the upper end must be finite, not 'inf'"),
        ("r=nan:1", "--set r=nan:1: the lower end must be finite, not 'nan'"),
        ("r=:", "--set r=:: the lower end must be a number, not ''"),
        ("r=0:x", "--set r=0:x: the upper end must be a number, not 'x'"),
        ("r=0:1:0", "--set r=0:1:0: the number of values must be an integer from 1 on, not '0'"),
        ("r=0:1:2.5", "--set r=0:1:2.5: the number of values must be an integer from 1 on, not '2.5'"),
        ("r=0:1:1", "--set r=0:1:1: 1 value cannot include both 0 and 1"),
        ("r=1:1:4", "--set r=1:1:4: all 4 values are equal"),
        ("r=0.5:0.5", "--set r=0.5:0.5: the range has only one value. Write 0.5"),
        ("r=-1e308:1e308", "--set r=-1e308:1e308: the range is too wide"),
        (
            "r=1:99999999999999999999",
            "--set r=1:99999999999999999999: the upper end is too large: integers have at most 64 bits",
        ),
        ("r=1:2:3:4", "--set r=1:2:3:4: a range is low:high or low:high:count"),
        ("r=1,,2", "--set r=1,,2: one of the values is empty"),
        ("r=1,2,1", "--set r=1,2,1: the value 1 is given twice"),
        ("r=0,02:0,05", "--set r=0,02:0,05: a list cannot contain a range, and '02:0' is one"),
        ("world=caf\udce9.sdf", r"--set world=caf\udce9.sdf is not valid UTF-8. Rename the file"),
        ("seed=-1,2", "--set seed=-1,2: seeds are integers from 0 on"),
        ("seed=0:1:3", "--set seed=0:1:3: seeds are integers from 0 on"),
        ("seed=0.5:2", "--set seed=0.5:2: seeds are integers from 0 on"),
    ],
)
def test_errors_of_a_text(text: str, error: str) -> None:
    with pytest.raises(KbotError) as raised:
        parse_dimension(text)
    assert str(raised.value) == error


def test_the_dimensions_of_a_space_have_different_names() -> None:
    with pytest.raises(KbotError, match="--set a is given twice"):
        parse_space(["a=1,2", "a=3,4"])


@pytest.mark.parametrize(
    ("name", "target"),
    [
        ("wheel_radius", Target.ARGUMENT),
        ("world", Target.WORLD),
        ("world.height", Target.WORLD_PARAMETER),
        ("seed", Target.SEED),
        ("scenario.steps.0.linear", Target.SCENARIO),
    ],
)
def test_what_a_name_sets(name: str, target: Target) -> None:
    assert parse_dimension(f"{name}=1,2").target is target


def test_a_grid_has_each_combination_once_and_the_last_dimension_varies_fastest() -> None:
    space = parse_space(["a=1,2", "b=x,y,z"])
    assert space.size == 6
    expected = [(1, "x"), (1, "y"), (1, "z"), (2, "x"), (2, "y"), (2, "z")]
    assert [space.grid(index) for index in range(6)] == expected


def test_a_billion_combinations_take_no_memory() -> None:
    space = parse_space([f"{name}=0.0:1.0:1000" for name in "abc"])
    assert space.size == 10**9
    assert space.grid(10**9 - 1) == (1.0, 1.0, 1.0)


def test_an_interval_has_no_size_and_rounds_to_a_millionth_of_its_range() -> None:
    space = parse_space(["a=0.02:0.05", "b=1,2"])
    assert space.size is None
    assert space.at((1 / 3, 0.5)) == (0.03, 2)
    value = Interval(0.0, 3000.0).at(0.123456789)
    assert value == pytest.approx(370.370367, abs=3000.0 * 1e-6)
    assert len(str(value)) <= 8


def test_fractions_give_each_value_of_a_list_an_equal_share() -> None:
    levels = Levels(0.0, 1.0, 5)
    assert [levels.at(fraction) for fraction in (0.0, 0.19, 0.2, 0.999999)] == [0.0, 0.0, 0.25, 1.0]


def test_a_dimension_is_shown_as_it_was_typed() -> None:
    assert str(Dimension("r", "0.020:0.05:7", Levels(0.02, 0.05, 7))) == "r=0.020:0.05:7"


@given(st.text("0123456789.:,-+einfax =", max_size=24), st.floats(0.0, 1.0, exclude_max=True))
@settings(max_examples=500)
def test_any_text_is_a_dimension_within_its_ends_or_one_error(text: str, fraction: float) -> None:
    try:
        dimension = parse_dimension(f"name={text}")
    except KbotError:
        return
    domain = dimension.domain
    for value in (*domain.samples(), domain.at(fraction)):
        assert type(value) is dimension.kind or dimension.kind is float
        if isinstance(domain, Choices):
            assert value in domain.values
        else:
            assert domain.low <= float(value) <= domain.high
