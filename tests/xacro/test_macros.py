"""Tests that parameters of macros are parsed as in the official package, but in bounded time."""

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import xacro
from kbot.xacro.macros import MacroParameter, parse_default, parse_parameters


def shown(parameter: MacroParameter) -> tuple[str, bool, str | None]:
    return parameter.name, parameter.forwarded, parameter.default


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("a b", [("a", False, None), ("b", False, None)]),
        ("a:=1 b=2", [("a", False, "1"), ("b", False, "2")]),
        ("a:='x y' *b **c", [("a", False, "'x y'"), ("*b", False, None), ("**c", False, None)]),
        ("a:=${2 * (b + 1)} c", [("a", False, "${2 * (b + 1)}"), ("c", False, None)]),
        ("a:=$(arg b) c", [("a", False, "$(arg b)"), ("c", False, None)]),
        ("a:=^ b:=^|3 c:=^|", [("a", True, None), ("b", True, "3"), ("c", True, None)]),
        ("a:= b", [("a", False, "b")]),
        ("", []),
    ],
)
def test_parameters(text: str, expected: list[tuple[str, bool, str | None]]) -> None:
    assert [shown(parameter) for parameter in parse_parameters(text)] == expected


@settings(max_examples=3000, deadline=None)
@given(st.text(st.sampled_from("ab:=^|'\" \n${}()*"), max_size=14).map(lambda text: "a" + text))
def test_same_as_official(text: str) -> None:
    name, default, rest = xacro.parse_macro_arg(text)
    found = parse_default(text)
    if found is None:
        assert default is None
    else:
        parameter, left = found
        assert default == (parameter.name if parameter.forwarded else None, parameter.default)
        assert (parameter.name, left) == (name, rest)


@pytest.mark.parametrize(
    "text", ["a:=" + "[" * 5000 + "'x", "a:=" + "'" * 301 + '"', "a:=" + "'x\"y" * 200 + "'\""]
)
def test_unbalanced_quotes_are_parsed_quickly(text: str) -> None:
    assert parse_parameters(text)[0].name.startswith("a")
