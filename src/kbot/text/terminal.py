"""Keeps names in files and messages of strangers from controlling the terminal."""

from __future__ import annotations

import re

TYPE_CHECKING = False
if TYPE_CHECKING:
    from collections.abc import Iterable
    from typing import TextIO

# marks of text direction can hide what a name is
_CONTROLS = r"|[\x00-\x08\x0b-\x1f\x7f-\x9f\u061c\u200e\u200f\u202a-\u202e\u2066-\u2069]"
_COLORS = r"\x1b\[(?:0|1|(?:1;)?3[0-7])?m|\r\n"
_TEXT = re.compile(f"({_COLORS}){_CONTROLS}")
"""KBot prints bold and colored text. A name that moved the cursor or cleared a line could hide a finding."""
_PROGRESS = re.compile(rf"({_COLORS}|\r|\x1b\[(?:\?25[lh]|1?A|2?K)){_CONTROLS}")
"""A progress line also hides and shows the cursor, moves it up, and clears the line."""


class TerminalStream:
    """A standard stream that is a terminal. Control characters are written as escapes, such as `\\x9b`."""

    def __init__(self, stream: TextIO, *, is_progress: bool = False) -> None:
        self.unfiltered = stream
        """For the user's own program, which may control the terminal."""
        self._controls = _PROGRESS if is_progress else _TEXT

    def __getattr__(self, name: str) -> object:
        """Everything else is the stream's."""
        return getattr(self.unfiltered, name)

    def write(self, text: str) -> int:
        self.unfiltered.write(self._controls.sub(lambda match: match[1] or ascii(match[0])[1:-1], text))
        return len(text)

    def writelines(self, lines: Iterable[str]) -> None:
        for line in lines:
            self.write(line)


def for_progress(stream: TextIO) -> TextIO:
    """The same terminal, for a progress line."""
    if not isinstance(stream, TerminalStream):
        return stream
    # it is a TextIO by __getattr__, which the type checker does not see
    return TerminalStream(stream.unfiltered, is_progress=True)  # type: ignore[return-value]
