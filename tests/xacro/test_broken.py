"""Tests broken documents. A comment in each lists the expected errors with line and column."""

import re
from pathlib import Path

import pytest

from kbot.xacro import expand

FOLDER = Path(__file__).parent / "broken"
FILES = sorted(FOLDER.glob("*.xacro"))


def expected(text: str) -> list[tuple[str, int, int]]:
    comment = re.search(r"<!-- expect: (.*?) -->", text)
    assert comment, "the document has no comment with the expected errors"
    entries = [re.fullmatch(r"(\w+) (\d+):(\d+)", entry) for entry in comment[1].split(", ")]
    return sorted((entry[1], int(entry[2]), int(entry[3])) for entry in entries if entry)


def test_there_are_enough_broken_files() -> None:
    assert len(FILES) >= 60


@pytest.mark.parametrize("file", FILES, ids=lambda file: file.stem)
def test_errors_are_reported_at_their_position(file: Path) -> None:
    expansion = expand(file)
    found = [
        (d.code, d.origin.span.line, d.origin.span.column)
        for d in expansion.diagnostics
        if d.is_error and d.origin is not None
    ]
    assert sorted(found) == expected(file.read_text()), [str(d) for d in expansion.diagnostics]
    assert not expansion.ok
