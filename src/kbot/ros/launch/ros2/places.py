"""Finds the line of a Python launch file that created an action."""

from __future__ import annotations

import ast
import sys
from functools import lru_cache
from types import FrameType

from kbot.text import Origin, Source, Span

_running: dict[str, Source] = {}


def register_running(source: Source) -> None:
    """Register a launch file that runs, so that its lines can be found."""
    _running[source.path] = source


def here() -> Origin | None:
    """The innermost line of the running launch file. None if none runs."""
    frame: FrameType | None = sys._getframe(1)
    while frame is not None:
        origin = place(frame.f_code.co_filename, frame.f_lineno)
        if origin is not None:
            return origin
        frame = frame.f_back
    return None


def place(file: str, line: int) -> Origin | None:
    """A line of a running launch file. None for any other file."""
    source = _running.get(file)
    return None if source is None else line_origin(source, line)


def line_origin(source: Source, number: int) -> Origin:
    """The origin of a whole line, without the space around it."""
    text = source.line(number)
    indent = len(text) - len(text.lstrip())
    start = source.offset(number, indent + 1)
    return Origin(Span(source, start, start + len(text.strip().encode())))


def parameter_place(node: Origin, name: str) -> Origin | None:
    """Where the call that created a node has a parameter's name in `parameters=`. None if the name is not
    there, or is not a literal."""
    source, line = node.span.source, node.span.line
    for call in _calls(source.text) if source.path.endswith(".py") else ():
        for keyword in call.keywords if call.lineno == line else ():
            for part in ast.walk(keyword.value) if keyword.arg == "parameters" else ():
                for key in part.keys if isinstance(part, ast.Dict) else ():
                    if isinstance(key, ast.Constant) and key.value == name:
                        return _origin(source, key)
    return None


@lru_cache(maxsize=8)
def _calls(text: str) -> tuple[ast.Call, ...]:
    return tuple(part for part in ast.walk(ast.parse(text)) if isinstance(part, ast.Call))


def _origin(source: Source, part: ast.Constant) -> Origin:
    first, last = part.col_offset, part.end_col_offset or part.col_offset  # both are in bytes, like spans
    start = source.offset(part.lineno, 1)
    return Origin(Span(source, start + first, start + last))
