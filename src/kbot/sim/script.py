"""Runs a user's function `drive(sim)` and reports its errors with file, line and values."""

from __future__ import annotations

import ast
import importlib
import inspect
import linecache
import sys
import threading
import traceback
from collections.abc import Callable, Iterator
from contextlib import contextmanager, redirect_stdout
from types import CodeType, FrameType, ModuleType, TracebackType
from typing import TextIO

from kbot.messages.log import ERROR
from kbot.sim.printed_lines import PrintStream
from kbot.sim.script_hints import hint_for, misnamed_drive, takes_a_simulation
from kbot.sim.simulation import Simulation
from kbot.sim.user_code import UserCode, shown_path
from kbot.text import KbotError
from kbot.text.errors import DescriptionError, Stopped
from kbot.text.files import read_source

MOST_FRAMES = 6
"""Calls that an error lists: the innermost ones. In a recursion, the outer calls are all the same."""


class ScriptError(KbotError):
    """A script cannot be run, or raised an error: at `line` of the file `path`."""

    def __init__(self, path: str, line: int, message: str, details: tuple[str, ...] = ()) -> None:
        self.path, self.line, self.message = path, line, message
        place = f"{shown_path(path)}:{line}"
        super().__init__("\n".join((f"{place}: {message}", *(f"    {each}" for each in details))))


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


class Script:
    """A file with a function `drive(sim)`, and the modules beside it that it imports."""

    def __init__(self, path: str) -> None:
        """Raises KbotError: the file does not exist or cannot be read."""
        self.path = path
        self.code = UserCode(path)
        self._known = frozenset(sys.modules)
        self._imported: tuple[str, ...] = ()
        """The files of the modules in the last run."""
        self.has_failed_thread = False
        """Whether an error ended a thread that the script started in the last run."""
        self._outer_hook: Callable[[threading.ExceptHookArgs], object] | None = None
        self.read()

    @property
    def files(self) -> tuple[str, ...]:
        """The script, and the imported modules in its folder."""
        return tuple(dict.fromkeys((self.path, *self._imported, *(file for _, file in self._modules()))))

    def read(self) -> str:
        """Return the text of the file. Raises KbotError: it does not exist, or cannot be read."""
        try:
            text = read_source(self.path).text
        except DescriptionError as error:
            (found,) = error.diagnostics
            hint = "save it as UTF-8" if found.code == "F005" else found.hint
            raise KbotError(found.message + (f" ({hint})" if hint else "")) from None
        return text

    def run(self, simulation: Simulation, stdout: TextIO | None = None) -> None:
        """Read the file and call its `drive(sim)`.

        The file is the user's own program, so it runs without restrictions. What it prints goes to `stdout`,
        by default to the standard output, and to `simulation.printed`.

        Raises:
            ScriptFailed: an assertion failed, or the script ended with `sys.exit` and a status other than 0.
            ScriptError: the file is not valid Python, has no `drive`, or raised another error.
            KbotError: the file cannot be read.
        """
        text = self.read()
        self._follow_threads(simulation)
        printed = PrintStream(stdout or sys.stdout, simulation.printed)
        try:
            with self._imports(), redirect_stdout(printed):
                linecache.getlines(self.path)  # errors quote the file as it is now
                self.call(text, simulation)
        except ScriptError as error:
            printed.end()
            for number, line in enumerate(str(error).split("\n")):
                simulation.printed.add(line, ERROR, error.path if number == 0 else "", error.line)
            raise
        finally:
            printed.end()
            simulation.draw.publish()  # drawings after the last step

    def call(self, text: str, simulation: Simulation) -> None:
        """Run the text of the script and its `drive`. `Interruption` recognizes the script by this frame."""
        module = ModuleType("kbot_script")
        module.__file__ = self.path
        code = self._compiled(text)
        sys.modules[module.__name__] = module  # where dataclasses and pickle look up the script's names
        try:
            exec(code, vars(module))  # noqa: S102 - the user's own program, named on the command line
            drive = getattr(module, "drive", None)
            if not callable(drive):
                raise self._no_drive(vars(module))
            if not takes_a_simulation(drive):
                text = "drive must have one parameter, the simulation. Write def drive(sim)"
                raise ScriptError(self.path, _line_of(drive), text)
            self._refuse_unfinished(drive, drive(simulation))
        except (ScriptError, Stopped, KeyboardInterrupt):
            raise
        except SystemExit as end:
            if end.code:
                raise self._exited(end, simulation) from None
        except BaseException as error:  # a user's exception may derive from BaseException alone
            raise self._explained(error, simulation) from error
        finally:
            sys.modules.pop(module.__name__, None)

    def _follow_threads(self, simulation: Simulation) -> None:
        """Report errors in the script's threads as the script's, also in threads that outlive the run."""
        self.has_failed_thread = False
        outer = self._outer_hook = self._outer_hook or threading.excepthook

        def hook(failed: threading.ExceptHookArgs) -> None:
            error = failed.exc_value
            if error is None or isinstance(error, SystemExit) or not self._own_frames(failed.exc_traceback):
                outer(failed)
                return
            self.has_failed_thread = True
            sys.stderr.write(f"error in a thread: {self._explained(error, simulation)}\n")
            sys.stderr.flush()

        threading.excepthook = hook

    @contextmanager
    def _imports(self) -> Iterator[None]:
        """Let the script import modules beside it, each time as they are now."""
        self._known = frozenset(sys.modules)
        importlib.invalidate_caches()
        linecache.checkcache()
        folder, writes = str(self.code.folder), sys.dont_write_bytecode
        sys.path.insert(0, folder)
        # the cache compares times in whole seconds, so a second save in the same second would be missed
        sys.dont_write_bytecode = True
        try:
            yield
        finally:
            sys.dont_write_bytecode = writes
            if folder in sys.path:  # the script may have changed it
                sys.path.remove(folder)
            modules = self._modules()
            self._imported = tuple(file for _, file in modules)
            for name, _ in modules:
                del sys.modules[name]

    def _modules(self) -> list[tuple[str, str]]:
        """Name and file of each module of the script's folder that the current run has imported."""
        found = []
        for name, module in tuple(sys.modules.items()):
            # not getattr, which would load the contents of a lazy module
            file = vars(module).get("__file__") if isinstance(module, ModuleType) else None
            if name not in self._known and isinstance(file, str) and self.code.has(file):
                found.append((name, file))
        return found

    def _compiled(self, text: str) -> CodeType:
        try:
            return compile(text, self.path, "exec", dont_inherit=True)  # not this module's future imports
        except SyntaxError as error:
            raise self._not_python(error, self.path) from None
        except ValueError as error:
            raise ScriptError(self.path, 1, f"not valid Python: {error}") from None

    def _not_python(self, error: SyntaxError, path: str) -> ScriptError:
        code = (error.text or "").rstrip("\n")
        details: tuple[str, ...] = (code.strip(),) if code.strip() else ()
        if details and error.offset:
            indent = len(code) - len(code.lstrip())
            details += (" " * max(0, error.offset - 1 - indent) + "^",)
        return ScriptError(path, error.lineno or 1, f"not valid Python: {error.msg}", details)

    def _no_drive(self, names: dict[str, object]) -> ScriptError:
        text, near = "the script has no function drive(sim)", misnamed_drive(names)
        if near is None:
            return ScriptError(self.path, 1, f"{text}. Put the program into def drive(sim):")
        hint = f"did you mean 'drive' instead of '{near.__name__}'?"
        return ScriptError(self.path, _line_of(near), f"{text} ({hint})")

    def _refuse_unfinished(self, drive: object, result: object) -> None:
        """Refuse a `drive` of which no line has run: an async function, or a generator."""
        if inspect.iscoroutine(result):
            result.close()
        if inspect.iscoroutine(result) or inspect.isasyncgen(result):
            text = "drive is an async function. Write def drive(sim)"
        elif inspect.isgenerator(result):
            text = "drive is a generator, because it contains yield. Remove yield"
        else:
            return
        raise ScriptError(self.path, _line_of(drive), text)

    def _explained(self, error: BaseException, simulation: Simulation) -> ScriptError:
        """The error of the user's code, with its place and, if possible, what to change."""
        if isinstance(error, AssertionError):
            return self._failed(error, simulation)
        if isinstance(error, SyntaxError):  # of an imported module
            return self._not_python(error, error.filename or self.path)
        name = "" if isinstance(error, KbotError) else f"{type(error).__name__}: "
        path, line, calls = self._place(error.__traceback__)
        frames = self._own_frames(error.__traceback__)
        hint = hint_for(error, frames[-1][0], calls[-1]) if frames else ""
        text = f"{name}{_text_of(str, error)}".removesuffix(": ") + (f" ({hint})" if hint else "")
        return ScriptError(path, line, text, calls)

    def _exited(self, end: SystemExit, simulation: Simulation) -> ScriptFailed:
        path, line, calls = self._place(end.__traceback__)
        call = f"sys.exit({_text_of(repr, end.code)})"
        return ScriptFailed(path, line, f"{self.code.name} ended with {call}", call, simulation.time, calls)

    def _failed(self, error: AssertionError, simulation: Simulation) -> AssertionFailed:
        path, line, calls = self._place(error.__traceback__)
        frames = self._own_frames(error.__traceback__)
        claim, names = _assertion_at(path, line)
        values = {}
        for name in names if frames else ():
            if (value := _value(name, frames[-1][0])) is not None:
                values[name] = value
        return AssertionFailed(path, line, claim, _text_of(str, error), simulation.time, values, calls[:-1])

    def _place(self, trace: TracebackType | None) -> tuple[str, int, tuple[str, ...]]:
        """File and line of an error, and the user's calls that led to it with the code of the last."""
        own = self._own_frames(trace)
        if not own:  # drive itself could not be called
            return self.path, 1, ()
        frame, line = own[-1]
        path = frame.f_code.co_filename
        code = linecache.getline(path, line, frame.f_globals).strip()
        calls = [
            f"{shown_path(caller.f_code.co_filename)}:{number} in {caller.f_code.co_name}: "
            + linecache.getline(caller.f_code.co_filename, number, caller.f_globals).strip()
            for caller, number in own[:-1]
        ]
        return path, line, (*calls[-MOST_FRAMES:], code)

    def _own_frames(self, trace: TracebackType | None) -> list[tuple[FrameType, int]]:
        return [
            (frame, line)
            for frame, line in traceback.walk_tb(trace)
            if self.code.has(frame.f_code.co_filename)
        ]


def _line_of(function: object) -> int:
    return function.__code__.co_firstlineno if inspect.isfunction(function) else 1


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
