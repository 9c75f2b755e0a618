"""Keeps names in files and messages of strangers from controlling the terminal."""

from __future__ import annotations

import re

TYPE_CHECKING = False
if TYPE_CHECKING:
    from collections.abc import Iterable
    from typing import TextIO

# KBot itself prints colors and a progress line: hide and show the cursor, move up, clear the line. Marks of
# text direction can hide what a name is.
_CONTROLS = re.compile(
    r"(\x1b\[(?:[0-9;]*m|\?25[lh]|1?A|2?K))"
    r"|[\x00-\x08\x0b\x0c\x0e-\x1f\x7f-\x9f\u061c\u200e\u200f\u202a-\u202e\u2066-\u2069]"
)


class TerminalStream:
    """A standard stream that is a terminal. Control characters are written as escapes, such as `\\x9b`."""

    def __init__(self, stream: TextIO) -> None:
        self.unfiltered = stream
        """For the user's own program, which may control the terminal."""

    def __getattr__(self, name: str) -> object:
        """Everything else is the stream's."""
        return getattr(self.unfiltered, name)

    def write(self, text: str) -> int:
        self.unfiltered.write(_CONTROLS.sub(lambda match: match[1] or ascii(match[0])[1:-1], text))
        return len(text)

    def writelines(self, lines: Iterable[str]) -> None:
        for line in lines:
            self.write(line)
