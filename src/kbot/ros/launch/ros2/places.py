"""Finds the line of a Python launch file that created an action."""

from __future__ import annotations

import ast
import linecache
import sys
from collections.abc import Iterator
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


def catches(error: type[Exception]) -> bool:
    """Whether the user's code that calls KBot is in a `try` that catches an error."""
    names = {base.__name__ for base in error.__mro__} | _NAMES_OF_ERRORS
    for file, line in _user_frames():
        source = _running.get(file)
        text = source.text if source else "".join(linecache.getlines(file))
        for block in _tries(text):
            if block.body[0].lineno <= line <= (block.body[-1].end_lineno or 0):
                for handler in block.handlers:
                    if handler.type is None or not names.isdisjoint(_names(handler.type)):
                        return True
    return False


_NAMES_OF_ERRORS = {"PackageNotFoundError"}
"""Names that launch files have for KBot's own classes."""


def _user_frames() -> Iterator[tuple[str, int]]:
    """The files and lines of the user's functions between KBot's reader and the call of KBot, the innermost
    first. Empty if the reader itself makes the call, for a substitution."""
    frame: FrameType | None = sys._getframe(1)
    while frame is not None and _module(frame).startswith("kbot."):
        if _module(frame) == _READER:
            return
        frame = frame.f_back
    while frame is not None and not _module(frame).startswith("kbot."):
        yield frame.f_code.co_filename, frame.f_lineno
        frame = frame.f_back


_READER = "kbot.ros.launch.ros2.reader"


def _module(frame: FrameType) -> str:
    return str(frame.f_globals.get("__name__", ""))


def _names(expression: ast.expr) -> set[str]:
    """The names in `except NAME`, `except module.NAME` and `except (NAME, NAME)`."""
    parts = list(ast.walk(expression))
    return {part.id for part in parts if isinstance(part, ast.Name)} | {
        part.attr for part in parts if isinstance(part, ast.Attribute)
    }


@lru_cache(maxsize=8)
def _tries(text: str) -> tuple[ast.Try, ...]:
    return tuple(part for part in ast.walk(ast.parse(text)) if isinstance(part, ast.Try))


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
