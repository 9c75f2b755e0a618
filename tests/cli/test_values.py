"""Tests VALUES of `kbot topic pub` and `kbot service call`: errors come before a connection is made."""

import pytest

from kbot.cli.main import run
from kbot.cli.ros.graph.common import read_values, read_word
from kbot.text import KbotError


@pytest.mark.parametrize(
    ("values", "message"),
    [
        ("{a: &a [*a]}", "its aliases expand to too many values"),
        ("&a {a: {b: *a}}", "its aliases expand to too many values"),
        ("[" * 1100 + "]" * 1100, "it is nested more than 100 levels deep"),
        ("{a: 2026-13-45}", "month must be in 1..12"),
        ("{a: !!int ''}", "VALUES must be YAML"),
        ("{a: !!bool perhaps}", "VALUES must be YAML"),
        ("{a: 2026-11-21}", "2026-11-21 is a date. Messages have no such type. Quote it if it is a string"),
        ("{? [a] : 1}", "VALUES must be YAML"),
        ("{linear: {x:0.2}}", "VALUES: YAML needs a space after the colon. Write x: 0.2"),
        ("{linear:{x: 0.2}, y:1}", "YAML needs a space after the colon. Write y: 1"),
        ("{2026-11-21: 1}", "2026-11-21 is not a field name"),
        ("{a: 1e308}", "YAML 1.1 reads 1e308 as a string. Write 1.0e+308, or quote"),
        ("{a: [-.5E3]}", "YAML 1.1 reads -.5E3 as a string. Write -0.5e+3, or quote"),
        ("{a: 2e-3}", "YAML 1.1 reads 2e-3 as a string. Write 2.0e-3, or quote"),
    ],
)
@pytest.mark.parametrize("verb", [("topic", "pub", "--once"), ("service", "call")])
def test_values_that_do_not_fit_the_message(
    verb: tuple[str, ...], values: str, message: str, capsys: pytest.CaptureFixture[str]
) -> None:
    assert run([*verb, "/name", values]) == 2
    assert message in capsys.readouterr().err


def test_a_bomb_of_aliases_is_bounded() -> None:
    lines = ["a0: &a0 [1, 1, 1, 1, 1, 1, 1, 1, 1, 1]"]
    lines += [f"a{n}: &a{n} [{', '.join([f'*a{n - 1}'] * 10)}]" for n in range(1, 9)]
    with pytest.raises(KbotError, match="its aliases expand to too many values"):
        read_values(("\n".join(lines),), "{}")


def test_aliases_and_valid_values_are_accepted() -> None:
    assert read_values(("{a: &a [1], b: *a, c: 1.0e+308, d: '1e3', e: 1.5e-3}",), "{}") == {
        "a": [1],
        "b": [1],
        "c": 1e308,
        "d": "1e3",
        "e": 0.0015,
    }
    assert read_word("e1", "VALUE", "0.5") == "e1"


def test_values_that_only_one_of_two_parsers_reads_are_accepted() -> None:
    assert read_word("[a?, '1e3']", "VALUE", "0.5") == ["a?", "1e3"]
    assert read_word("{a:{b: 1}}", "VALUE", "0.5") == {"a": {"b": 1}}
