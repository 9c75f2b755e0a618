"""Which line of a launch file made an action: the line that is running while it is made."""

from __future__ import annotations

import sys
from types import FrameType

from kbot.text import Origin, Source, Span

_running: dict[str, Source] = {}


def running(source: Source) -> None:
    """Let lines of a launch file be found while it runs."""
    _running[source.path] = source


def here() -> Origin | None:
    """The innermost line of a running launch file; None where none runs."""
    frame: FrameType | None = sys._getframe(1)
    while frame is not None:
        origin = place(frame.f_code.co_filename, frame.f_lineno)
        if origin is not None:
            return origin
        frame = frame.f_back
    return None


def place(file: str, line: int) -> Origin | None:
    """A line of a running launch file; None for any other file."""
    source = _running.get(file)
    return None if source is None else line_origin(source, line)


def line_origin(source: Source, number: int) -> Origin:
    """A whole line, without the space around it."""
    text = source.line(number)
    indent = len(text) - len(text.lstrip())
    start = source.offset(number, indent + 1)
    return Origin(Span(source, start, start + len(text.strip().encode())))
