"""Runs a user's function `drive(sim)` and reports a failed assertion with its time and values."""

from __future__ import annotations

import ast
import sys
import traceback
from pathlib import Path
from types import CodeType, FrameType, TracebackType

from kbot.sim.simulation import Simulation
from kbot.text import KbotError
from kbot.text.files import read_source


class ScriptFailed(KbotError):
    """An assertion of a script failed."""

    def __init__(
        self, path: str, line: int, claim: str, message: str, time: float, values: dict[str, str]
    ) -> None:
        self.path, self.line, self.claim, self.message = path, line, claim, message
        self.time, self.values = time, values
        detail = f": {message}" if message else ""
        lines = [f"{path}:{line}: assertion failed at {time:.3f} s: {claim}{detail}"]
        lines += [f"    {name} = {value}" for name, value in values.items()]
        super().__init__("\n".join(lines))

    def to_json(self) -> dict[str, object]:
        return {
            "file": self.path,
            "line": self.line,
            "time_s": self.time,
            "assertion": self.claim,
            "message": self.message,
            "values": self.values,
        }


def run_script(path: str, simulation: Simulation) -> None:
    """Run the file and call its `drive(sim)`.

    The file is the user's own program, so it runs without restrictions.

    Raises:
        ScriptFailed: an assertion failed.
        KbotError: the file is not valid Python, has no `drive`, or raised another error.
    """
    source = read_source(path)
    code = _compiled(source.text, path)
    namespace: dict[str, object] = {"__name__": "kbot_script", "__file__": path}
    folder = str(Path(path).resolve().parent)
    sys.path.insert(0, folder)
    try:
        exec(code, namespace)  # noqa: S102 - the user's own program, named on the command line
        drive = namespace.get("drive")
        if not callable(drive):
            raise KbotError(f"{path} has no function drive(sim)")
        drive(simulation)
    except KbotError:
        raise
    except AssertionError as error:
        raise _failed(path, source.text, error, simulation) from None
    except Exception as error:
        where = _line_in(path, error.__traceback__)
        raise KbotError(f"{path}:{where}: {type(error).__name__}: {error}") from error
    finally:
        sys.path.remove(folder)


def _compiled(text: str, path: str) -> CodeType:
    try:
        return compile(text, path, "exec")
    except (SyntaxError, ValueError) as error:
        line = getattr(error, "lineno", None) or 1
        raise KbotError(f"{path}:{line}: not valid Python: {error}") from None


def _failed(path: str, text: str, error: AssertionError, simulation: Simulation) -> ScriptFailed:
    line = _line_in(path, error.__traceback__)
    frame = _frame_in(path, error.__traceback__)
    claim, names = _assertion_at(text, line)
    values = {name: value for name in names if (value := _value(name, frame)) is not None}
    return ScriptFailed(path, line, claim, str(error), simulation.time, values)


def _assertion_at(text: str, line: int) -> tuple[str, list[str]]:
    """The condition of the assertion at a line, and the names and attributes in it."""
    for node in ast.walk(ast.parse(text)):
        if isinstance(node, ast.Assert) and node.lineno <= line <= (node.end_lineno or node.lineno):
            parts = [n for n in ast.walk(node.test) if isinstance(n, ast.Name | ast.Attribute)]
            inner = {id(n.value) for n in parts if isinstance(n, ast.Attribute)}
            functions = {id(n.func) for n in ast.walk(node.test) if isinstance(n, ast.Call)}
            outer = [n for n in parts if id(n) not in inner and id(n) not in functions]
            return ast.unparse(node.test), list(dict.fromkeys(ast.unparse(n) for n in outer))
    return "", []


def _value(name: str, frame: FrameType | None) -> str | None:
    """The repr of a dotted name's value in a frame, or None if the name is not defined there."""
    if frame is None:
        return None
    first, *rest = name.split(".")
    scope = {**frame.f_globals, **frame.f_locals}
    if first not in scope:
        return None
    value = scope[first]
    for attribute in rest:
        value = getattr(value, attribute, None)
    return repr(value)


def _frames(trace: TracebackType | None) -> list[tuple[FrameType, int]]:
    return [(frame, line) for frame, line in traceback.walk_tb(trace)]


def _frame_in(path: str, trace: TracebackType | None) -> FrameType | None:
    """The innermost frame that runs the script."""
    own = [frame for frame, _ in _frames(trace) if frame.f_code.co_filename == path]
    return own[-1] if own else None


def _line_in(path: str, trace: TracebackType | None) -> int:
    own = [line for frame, line in _frames(trace) if frame.f_code.co_filename == path]
    return own[-1] if own else 1
