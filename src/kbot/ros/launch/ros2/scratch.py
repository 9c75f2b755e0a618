"""Writes texts that a launch file makes to temporary files, so that they can be read by their path."""

from __future__ import annotations

from functools import cache
from itertools import count
from pathlib import Path

from kbot.text.temporary import TemporaryFolder


def scratch_file(text: str, suffix: str) -> str:
    """Write a text to a new file and return its path. The file is deleted when KBot exits."""
    file = _folder() / f"{next(_numbers)}{suffix}"
    file.write_text(text, encoding="utf-8")
    return str(file)


@cache
def _folder() -> Path:
    return TemporaryFolder("launch").path


_numbers = count()
