"""Explains the errors of the user's program: their file, line, code and values, and what to change."""

from __future__ import annotations

import ast
import linecache
import traceback
from collections.abc import Callable
from types import FrameType, TracebackType

from kbot.messages.log import ERROR
from kbot.sim.printed_lines import PrintedLines
from kbot.sim.script_hints import hint_for
from kbot.sim.user_code import UserCode, shown_path
from kbot.text import KbotError

MOST_FRAMES = 6
"""Calls that an error lists: the innermost ones. In a recursion, the outer calls are all the same."""


class ScriptError(KbotError):
    """A script cannot be run, or raised an error: at `line` of the file `path`."""

    def __init__(self, path: str, line: int, message: str, details: tuple[str, ...] = ()) -> None:
        self.path, self.line, self.message = path, line, message
        place = f"{shown_path(path)}:{line}"
        super().__init__("\n".join((f"{place}: {message}", *(f"    {each}" for each in details))))

    def publish(self, lines: PrintedLines) -> None:
        """Publish the error among the lines that the program printed."""
        for number, line in enumerate(str(self).split("\n")):
            lines.add(line, ERROR, self.path if number == 0 else "", self.line)


class ScriptFailed(ScriptError):
    """A script reports that its run failed: `reason` is why, at a simulated time in seconds."""

    def __init__(
        self, path: str, line: int, text: str, reason: str, time: float, details: tuple[str, ...] = ()
    ) -> None:
        self.reason, self.time = reason, time
        super().__init__(path, line, text, details)

    def to_json(self) -> dict[str, object]:
        return {
            "file": self.path,
            "line": self.line,
            "time_s": self.time,
            "assertion": "",
            "message": self.reason,
            "values": {},
        }


class AssertionFailed(ScriptFailed):
    """An assertion of a script failed."""

    def __init__(
        self,
        path: str,
        line: int,
        claim: str,
        message: str,
        time: float,
        values: dict[str, str],
        details: tuple[str, ...] = (),
    ) -> None:
        self.claim, self.values = claim, values
        text = f"assertion failed at {time:.3f} s: {claim}" + (f": {message}" if message else "")
        shown = tuple(f"{name} = {value}" for name, value in values.items())
        super().__init__(path, line, text, message, time, (*shown, *details))

    def to_json(self) -> dict[str, object]:
        return {**super().to_json(), "assertion": self.claim, "values": self.values}


class Explanations:
    """Explains errors that the user's code raised. Their times are simulated, in s."""

    def __init__(self, code: UserCode) -> None:
        self._code = code

    def explained(self, error: BaseException, time: float) -> ScriptError:
        """The error of the user's code, with its place and, if possible, what to change."""
        if isinstance(error, AssertionError):
            return self._failed(error, time)
        if isinstance(error, SyntaxError):  # of an imported module
            return self.not_python(error, error.filename or self._code.path)
        name = "" if isinstance(error, KbotError) else f"{type(error).__name__}: "
        path, line, calls = self._place(error.__traceback__)
        frames = self.own_frames(error.__traceback__)
        hint = hint_for(error, frames[-1][0], calls[-1]) if frames else ""
        text = f"{name}{_text_of(str, error)}".removesuffix(": ") + (f" ({hint})" if hint else "")
        return ScriptError(path, line, text, calls)

    def exited(self, end: SystemExit, time: float) -> ScriptFailed:
        path, line, calls = self._place(end.__traceback__)
        call = f"sys.exit({_text_of(repr, end.code)})"
        return ScriptFailed(path, line, f"{self._code.name} ended with {call}", call, time, calls)

    def _failed(self, error: AssertionError, time: float) -> AssertionFailed:
        path, line, calls = self._place(error.__traceback__)
        frames = self.own_frames(error.__traceback__)
        claim, names = _assertion_at(path, line)
        values = {}
        for name in names if frames else ():
            if (value := _value(name, frames[-1][0])) is not None:
                values[name] = value
        return AssertionFailed(path, line, claim, _text_of(str, error), time, values, calls[:-1])

    def _place(self, trace: TracebackType | None) -> tuple[str, int, tuple[str, ...]]:
        """File and line of an error, and the user's calls that led to it with the code of the last."""
        own = self.own_frames(trace)
        if not own:  # drive itself could not be called
            return self._code.path, 1, ()
        frame, line = own[-1]
        path = frame.f_code.co_filename
        code = linecache.getline(path, line, frame.f_globals).strip()
        calls = [
            f"{shown_path(caller.f_code.co_filename)}:{number} in {caller.f_code.co_name}: "
            + linecache.getline(caller.f_code.co_filename, number, caller.f_globals).strip()
            for caller, number in own[:-1]
        ]
        return path, line, (*calls[-MOST_FRAMES:], code)

    def own_frames(self, trace: TracebackType | None) -> list[tuple[FrameType, int]]:
        return [
            (frame, line)
            for frame, line in traceback.walk_tb(trace)
            if self._code.has(frame.f_code.co_filename)
        ]

    def not_python(self, error: SyntaxError, path: str) -> ScriptError:
        code = (error.text or "").rstrip("\n")
        details: tuple[str, ...] = (code.strip(),) if code.strip() else ()
        if details and error.offset:
            indent = len(code) - len(code.lstrip())
            details += (" " * max(0, error.offset - 1 - indent) + "^",)
        return ScriptError(path, error.lineno or 1, f"not valid Python: {error.msg}", details)


def _assertion_at(path: str, line: int) -> tuple[str, list[str]]:
    """The condition of the assertion at a line, and the names and attributes in it."""
    for node in ast.walk(ast.parse("".join(linecache.getlines(path)))):
        if isinstance(node, ast.Assert) and node.lineno <= line <= (node.end_lineno or node.lineno):
            parts = [n for n in ast.walk(node.test) if isinstance(n, ast.Name | ast.Attribute)]
            inner = {id(n.value) for n in parts if isinstance(n, ast.Attribute)}
            functions = {id(n.func) for n in ast.walk(node.test) if isinstance(n, ast.Call)}
            outer = [n for n in parts if id(n) not in inner and id(n) not in functions]
            return ast.unparse(node.test), list(dict.fromkeys(ast.unparse(n) for n in outer))
    return "", []


def _value(name: str, frame: FrameType) -> str | None:
    """The repr of a dotted name's value in a frame, or None if the name is not defined there."""
    first, *rest = name.split(".")
    scope = {**frame.f_globals, **frame.f_locals}
    if first not in scope:
        return None
    value = scope[first]
    try:
        for attribute in rest:
            value = getattr(value, attribute, None)
    except Exception as error:  # noqa: BLE001 - a property of the user's
        return f"<{type(error).__name__}>"
    return _text_of(repr, value)


def _text_of(write: Callable[[object], str], value: object) -> str:
    """`str` or `repr` of the user's object, whose own code may fail."""
    try:
        return write(value)
    except Exception as error:  # noqa: BLE001 - the user's code
        return f"<{type(value).__name__}: {type(error).__name__} while writing it>"
