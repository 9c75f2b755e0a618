"""Tests parsing JSON from outside: all errors have one type."""

import pytest

from kbot.text.json_text import parse_json


@pytest.mark.parametrize("text", ["", "[", "{'a': 1}", "[" * 100_000, b"\xff", "9" * 5_000])
def test_invalid_json_is_a_value_error(text: str | bytes) -> None:
    with pytest.raises(ValueError):  # noqa: PT011 - callers rely on the type alone
        parse_json(text)


def test_values_are_parsed() -> None:
    assert parse_json('{"a": [1, 2.5, null, true]}') == {"a": [1, 2.5, None, True]}
