"""Reads the scenarios of a Python file: its module-level scenarios, and lists of them, in order."""

from __future__ import annotations

import sys
from collections.abc import Iterator
from pathlib import Path
from types import ModuleType

from kbot.sim.own_imports import OwnImports
from kbot.sim.script_errors import Explanations
from kbot.sim.user_code import UserCode, shown_path
from kbot.text import KbotError, read_source
from kbot.trials.places import placed
from kbot.trials.scenario import Scenario

_MODULE = "kbot_scenarios"


def read_python_scenarios(path: str) -> list[Scenario]:
    """Run a Python file and return its scenarios.

    The file is the user's own program, so it runs without restrictions. What it imports from its own folder
    is imported again each time: all trials begin equally.

    Raises:
        KbotError: the file cannot be read, raised an error, or has no scenario.
    """
    text = read_source(path).text
    module = ModuleType(_MODULE)
    module.__file__ = path
    code = UserCode(path)
    try:
        with OwnImports(code):
            sys.modules[_MODULE] = module  # where dataclasses and pickle look up its names
            exec(compile(text, path, "exec", dont_inherit=True), vars(module))  # noqa: S102 - the user's own
    except SyntaxError as error:
        raise Explanations(code).not_python(error, error.filename or path) from None
    except (Exception, SystemExit) as error:  # noqa: BLE001 - the user's own program
        raise Explanations(code).explained(error, 0.0) from None
    found = {id(scenario): scenario for scenario in _scenarios(module)}
    if not found:
        raise KbotError(f"{shown_path(path)} defines no Scenario")
    return [placed(scenario, Path(path).parent) for scenario in found.values()]


def _scenarios(module: ModuleType) -> Iterator[Scenario]:
    for name, value in vars(module).items():
        if isinstance(value, Scenario) and not name.startswith("_"):
            yield value
        elif isinstance(value, list | tuple) and not name.startswith("_"):
            yield from (each for each in value if isinstance(each, Scenario))
