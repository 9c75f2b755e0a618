"""Runs a user's function `drive(sim)`."""

from __future__ import annotations

import inspect
import linecache
import sys
import threading
from collections.abc import Callable
from contextlib import redirect_stdout
from types import CodeType, ModuleType
from typing import TextIO

from kbot.sim.own_imports import OwnImports
from kbot.sim.printed_lines import PrintStream
from kbot.sim.script_errors import Explanations, ScriptError
from kbot.sim.script_hints import misnamed_drive, takes_a_simulation
from kbot.sim.simulation import Simulation
from kbot.sim.user_code import UserCode
from kbot.text import KbotError
from kbot.text.errors import DescriptionError, Stopped
from kbot.text.files import read_source


class Script:
    """A file with a function `drive(sim)`, and the modules beside it that it imports."""

    def __init__(self, path: str) -> None:
        """Raises KbotError: the file does not exist or cannot be read."""
        self.path = path
        self.code = UserCode(path)
        self._explanations = Explanations(self.code)
        self._imports = OwnImports(self.code)
        self.has_failed_thread = False
        """Whether an error ended a thread that the script started in the last run."""
        self._outer_hook: Callable[[threading.ExceptHookArgs], object] | None = None
        self.read()

    @property
    def files(self) -> tuple[str, ...]:
        """The script, and the imported modules in its folder."""
        return tuple(dict.fromkeys((self.path, *self._imports.files)))

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
            with self._imports, redirect_stdout(printed):
                linecache.getlines(self.path)  # errors quote the file as it is now
                self.call(text, simulation)
        except ScriptError as error:
            printed.end()
            error.publish(simulation.printed)
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
                raise self._explanations.exited(end, simulation.time) from None
        except BaseException as error:  # a user's exception may derive from BaseException alone
            raise self._explanations.explained(error, simulation.time) from error
        finally:
            sys.modules.pop(module.__name__, None)

    def _follow_threads(self, simulation: Simulation) -> None:
        """Report errors in the script's threads as the script's, also in threads that outlive the run."""
        self.has_failed_thread = False
        outer = self._outer_hook = self._outer_hook or threading.excepthook

        def hook(failed: threading.ExceptHookArgs) -> None:
            error = failed.exc_value
            if (
                error is None
                or isinstance(error, SystemExit)
                or not self._explanations.own_frames(failed.exc_traceback)
            ):
                outer(failed)
                return
            self.has_failed_thread = True
            sys.stderr.write(f"error in a thread: {self._explanations.explained(error, simulation.time)}\n")
            sys.stderr.flush()

        threading.excepthook = hook

    def _compiled(self, text: str) -> CodeType:
        try:
            return compile(text, self.path, "exec", dont_inherit=True)  # not this module's future imports
        except SyntaxError as error:
            raise self._explanations.not_python(error, self.path) from None
        except ValueError as error:
            raise ScriptError(self.path, 1, f"not valid Python: {error}") from None

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


def _line_of(function: object) -> int:
    return function.__code__.co_firstlineno if inspect.isfunction(function) else 1
