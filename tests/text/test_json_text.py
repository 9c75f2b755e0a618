"""JSON that others wrote: all that makes it unusable is one type of error."""

import pytest

from kbot.text.json_text import parse_json


@pytest.mark.parametrize("text", ["", "[", "{'a': 1}", "[" * 100_000, b"\xff", "9" * 5_000])
def test_what_cannot_be_used_is_a_value_error(text: str | bytes) -> None:
    with pytest.raises(ValueError):  # noqa: PT011 - callers rely on the type alone
        parse_json(text)


def test_values_are_those_of_json() -> None:
    assert parse_json('{"a": [1, 2.5, null, true]}') == {"a": [1, 2.5, None, True]}
