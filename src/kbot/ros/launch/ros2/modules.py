"""Runs a launch file in Python, with modules of our own in the place of ROS 2's."""

from __future__ import annotations

import os
import re
import sys
import traceback
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from io import StringIO
from pathlib import Path
from types import ModuleType
from typing import IO, Any

from kbot.ros.launch.launch_error import LaunchError
from kbot.ros.launch.plan import RobotDescription
from kbot.ros.launch.ros2 import actions
from kbot.ros.launch.ros2.contents import Module, modules_of
from kbot.ros.launch.ros2.context import LaunchContext
from kbot.ros.launch.ros2.places import line_origin, place, running
from kbot.text import Diagnostic, KbotError, Origin, Severity, Source, read_source
from kbot.text.errors import DescriptionError
from kbot.text.suggest import did_you_mean


@contextmanager
def _in_place(modules: Mapping[str, ModuleType]) -> Iterator[None]:
    names = {name for name in sys.modules if name.partition(".")[0] in {n.partition(".")[0] for n in modules}}
    kept = {name: sys.modules.pop(name) for name in names}
    sys.modules.update(modules)
    try:
        yield
    finally:
        for name in modules:
            sys.modules.pop(name, None)
        sys.modules.update(kept)


def _places(error: BaseException) -> list[Origin]:
    """The lines of launch files that an exception came through, the innermost last."""
    frames = traceback.extract_tb(error.__traceback__)
    return [found for frame in frames if (found := place(frame.filename, frame.lineno or 1))]


def _said(error: BaseException) -> tuple[str, str]:
    """What is said of an exception of a launch file, and what can be done."""
    frames = traceback.extract_tb(error.__traceback__)
    if isinstance(error, KeyError) and frames and frames[-1].filename in ("<frozen os>", os.__file__):
        name = error.args[0]
        return f"the environment variable {name} is not set", f"set it: {name}=… kbot launch …"
    if isinstance(error, ModuleNotFoundError):
        hint = "install it beside KBot, or name its folder in PYTHONPATH"
        return f"the launch file needs the Python module '{error.name}'", hint
    if isinstance(error, ImportError):
        missing = re.match(r"cannot import name '(\w+)'", str(error))
        module = sys.modules.get(error.name or "")
        if missing and isinstance(module, Module):
            return f"KBot has no {error.name}.{missing[1]}", did_you_mean(missing[1], vars(module))
    return f"the launch file fails: {type(error).__name__}: {error}", ""


class PythonFiles:
    """Runs launch files in Python within one context."""

    def __init__(self, context: LaunchContext) -> None:
        self.context = context
        self._modules = modules_of(context)

    @contextmanager
    def modules_in_place(self) -> Iterator[None]:
        """ROS 2's modules replaced by ours, also for what a launch file calls later."""
        with _in_place(self._modules):
            yield

    def load(self, source: Source) -> list[object]:
        """The entities of a file's `generate_launch_description()`.

        Raises:
            DescriptionError: L081 it fails, L082 it has no such function, or one that returns none.
        """
        running(source)
        namespace: dict[str, Any] = {"__name__": "launch_file", "__file__": source.path, "open": self._open}
        return self.guarded(source, lambda: self._entities(source, namespace))

    def _entities(self, source: Source, namespace: dict[str, Any]) -> list[object]:
        exec(compile(source.text, source.path, "exec"), namespace)  # noqa: S102 - trust was asked for
        generate = namespace.get("generate_launch_description")
        if not callable(generate):
            message = "a launch file in Python has a function generate_launch_description()"
            raise DescriptionError([Diagnostic("L082", Severity.ERROR, message, line_origin(source, 1))])
        description = generate()
        if not isinstance(description, actions.LaunchDescription):
            message = f"generate_launch_description() returned {type(description).__name__}"
            at = line_origin(source, getattr(getattr(generate, "__code__", None), "co_firstlineno", 1))
            raise DescriptionError(
                [Diagnostic("L082", Severity.ERROR, message, at, "return a LaunchDescription")]
            )
        return description.entities

    def guarded(self, source: Source, work: Callable[[], list[object]]) -> list[object]:
        """Runs the user's code; what it raises is an error at the line of the launch file that did it."""
        try:
            return work()
        except KbotError:
            raise
        except LaunchError as fault:
            where = (_places(fault) or [line_origin(source, 1)])[-1]
            found = Diagnostic(fault.code, Severity.ERROR, fault.message, where, fault.hint)
        except SyntaxError as error:
            at = line_origin(source, error.lineno or 1)
            found = Diagnostic("L081", Severity.ERROR, f"not valid Python: {error.msg}", at)
        except (Exception, SystemExit) as error:  # noqa: BLE001 - whatever a stranger's program raises
            message, hint = _said(error)
            where = (_places(error) or [line_origin(source, 1)])[-1]
            found = Diagnostic("L081", Severity.ERROR, message, where, hint)
        raise DescriptionError([found])

    def _open(self, path: Any, mode: str = "r", *args: Any, **more: Any) -> IO[Any]:
        """`open`, remembering which text came from which robot file."""
        if mode in ("r", "rt") and Path(path).suffix in (".urdf", ".xacro", ".xml"):
            text = read_source(path).text
            self.context.descriptions[text] = RobotDescription(str(path), {})
            return StringIO(text)
        return open(path, mode, *args, **more)  # noqa: PTH123 - the caller closes it
