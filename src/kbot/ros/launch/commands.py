"""Runs the `command=` of a parameter. KBot replaces xacro, cat, env and env_run. Others need permission."""

from __future__ import annotations

import json
import os
import re
import shlex
import sys
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import replace
from pathlib import PurePath
from typing import TYPE_CHECKING

from kbot.ros.launch.includes import charge
from kbot.ros.launch.known_packages import stand_in_file
from kbot.ros.launch.launch_error import LaunchError
from kbot.ros.launch.plan import RobotDescription
from kbot.ros.launch.quoting import split_words
from kbot.ros.launch.reporter import part_of, removal_of
from kbot.text import Diagnostic, Origin, Severity, read_source
from kbot.text.installed import find_file
from kbot.worker import children
from kbot.xacro import expand
from kbot.xacro.budget import Budget
from kbot.xacro.limits import Limits
from kbot.xacro.packages import Packages

if TYPE_CHECKING:
    from kbot.xacro import Expansion

_XACRO = ("xacro", "xacro.py")
_RUNNERS = (["rosrun", "xacro"], ["ros2", "run", "xacro"])
"""Commands that run a program of the package xacro."""
_VARIABLE = re.compile(r"\s*(?:export\s+)?([A-Za-z_]\w*)=([^$`]*)")
_PRINT_ENVIRONMENT = '__import__("json").dump(dict(__import__("os").environ),__import__("sys").stdout)'
"""Python without spaces, because a shell script's $@ splits words at them."""
_XACRO_FLAGS = {"--check-order", "--deps", "--just-deps", "--just-includes", "-q"}
_XACRO_VALUES = {"--verbosity", "-o"}
_TIMEOUT_S = 60.0
"""A command that takes longer fails."""
_COMMENT = re.compile(r"<!--.*?(?:-->|\Z)", re.DOTALL)

Note = Callable[[Diagnostic], None]


def run(
    command: str,
    packages: Packages,
    origin: Origin,
    note: Note,
    budget: Budget,
    allowed: bool,
    environment: Mapping[str, str],
) -> tuple[str, RobotDescription | None]:
    """The output of a command in an environment and, if it prints a robot, which robot that is.

    Errors in the description are passed to `note`. The launch continues, to show what it can of the robot.

    Raises:
        LaunchError: L040 the command is not allowed, L041 it fails, L056 xacro does not have the option,
            L070 it takes too much work.
    """
    try:
        words = split_words(command)
    except ValueError as error:
        raise LaunchError("L041", f"the command cannot be split into words: {error}", "", command) from None
    if not words:
        raise LaunchError("L041", "the command is empty")
    name = PurePath(words[0]).name
    if name == "cat" and len(words) == 2:
        text = read_source(words[1]).text
        return text, description_of(words[1], text)
    words = next((words[len(runner) :] for runner in _RUNNERS if words[: len(runner)] == runner), words)
    at = next((number for number, word in enumerate(words) if PurePath(word).name in _XACRO), None)
    if at is None:
        _require(allowed, name, words[0])
        return _process(words, environment), None
    variables = _variables(words[:at], allowed, environment)
    with _environment({**environment, **variables}):
        text, description = _xacro(words[at:], packages, origin, note, budget)
    return text, replace(description, environment=variables)


def _require(allowed: bool, name: str, written: str) -> None:
    if not allowed:
        hint = (
            "if you trust the launch file, run it with kbot launch FILE --allow-commands; without it, KBot "
            "runs only xacro, cat, env and env_run"
        )
        raise LaunchError("L040", f"the command '{name}' is not run", hint, written)


def _variables(wrapper: list[str], allowed: bool, environment: Mapping[str, str]) -> Mapping[str, str]:
    """The variables that a wrapper sets for the command after it: `env NAME=VALUE …`, Clearpath's `env_run
    FILE`, or a program that runs the command at its end."""
    if not wrapper:
        return {}
    name = PurePath(wrapper[0]).name
    if name == "env" and all("=" in word for word in wrapper[1:]):
        return dict(word.split("=", 1) for word in wrapper[1:])
    if name == "env_run" and len(wrapper) == 2:
        return dict(_assignments(wrapper[1]))
    _require(allowed, name, wrapper[0])
    printed = _process([*wrapper, sys.executable, "-P", "-c", _PRINT_ENVIRONMENT], environment)
    try:
        found: dict[str, str] = json.loads(printed)
    except ValueError:
        message = f"{name} does not run the xacro command after it, or prints something besides"
        raise LaunchError("L041", message, "run xacro without it", wrapper[0]) from None
    return {name: value for name, value in found.items() if environment.get(name) != value}


def _assignments(path: str) -> Iterator[tuple[str, str]]:
    """The variables in a file that a shell would read."""
    for number, line in enumerate(read_source(path).text.splitlines(), 1):
        text = line.partition("#")[0].strip()
        if not text:
            continue
        found = _VARIABLE.fullmatch(text)
        try:
            values = shlex.split(found[2]) if found else ["", ""]
        except ValueError:
            values = ["", ""]
        if found is None or len(values) > 1:
            message = f"{path}:{number}: not a line of the form NAME=VALUE: {text}"
            raise LaunchError("L041", message, "KBot reads only such lines of this file", path)
        yield found[1], "".join(values)


@contextmanager
def _environment(variables: Mapping[str, str]) -> Iterator[None]:
    """Make `variables` the environment, which xacro reads, within the block."""
    kept = dict(os.environ)
    os.environ.clear()
    os.environ.update(variables)
    try:
        yield
    finally:
        os.environ.clear()
        os.environ.update(kept)


def description_of(path: str, text: str) -> RobotDescription | None:
    """The robot in the text of a file. None if the text is not a robot or must be expanded by xacro first."""
    is_robot = "<robot" in text and "xacro:" not in _COMMENT.sub("", text)
    return RobotDescription(path, {}) if is_robot else None


def expand_within(budget: Budget, file: str, arguments: Mapping[str, str], packages: Packages) -> Expansion:
    """Expand a description. The work is charged to the budget of the launch file.

    Raises:
        LaunchError: L012, the file is in an absent package; L070, all descriptions and files together exceed
            the budget.
    """
    if stand_in_file(file):
        raise LaunchError("L012", f"{file} does not exist")
    limits = Limits(steps=max(budget.steps, 0))
    expansion = expand(file, arguments, packages=packages.beside(file), limits=limits, lenient=True)
    charge(budget, file, expansion.steps + (len(expansion.text) >> 3), "takes too many steps to expand")
    return expansion


def _xacro(
    words: list[str], packages: Packages, origin: Origin, note: Note, budget: Budget
) -> tuple[str, RobotDescription]:
    files: list[str] = []
    arguments: dict[str, str] = {}
    if PurePath(words[0]).name == "xacro.py":
        message, hint = "xacro.py was removed in xacro 1.14 (Noetic)", "use xacro instead of xacro.py"
        note(Diagnostic("L053", Severity.ERROR, message, part_of(origin, "xacro.py"), hint))
    rest = iter(words[1:])
    for word in rest:
        if ":=" in word:
            key, _, value = word.partition(":=")
            arguments[key] = value
        elif word in ("--inorder", "-i"):
            message = f"{word} has no effect: xacro processes a file in order since Melodic"
            place = part_of(origin, word)
            fix = removal_of(place, word)
            note(Diagnostic("L057", Severity.INFO, message, place, "remove the option", fix=fix))
        elif word in _XACRO_VALUES:
            next(rest, None)
        elif word.startswith("-") and word not in _XACRO_FLAGS:
            raise LaunchError("L056", f"xacro has no option {word}", "remove it", word)
        elif not word.startswith("-"):
            files.append(word)
    if len(files) != 1:
        raise LaunchError("L041", f"xacro takes one file, and the command names {len(files)}")
    file = find_file(files[0]) or files[0]
    expansion = expand_within(budget, file, arguments, packages)
    for diagnostic in expansion.diagnostics:
        note(diagnostic)
    return expansion.text, RobotDescription(file, arguments)


def _process(words: list[str], environment: Mapping[str, str]) -> str:
    try:
        done = children.run(words, environment=environment, seconds=_TIMEOUT_S)
    except TimeoutError:
        message = f"the command did not end within {_TIMEOUT_S:g} s"
        raise LaunchError("L041", message, "", words[0]) from None
    except OSError as error:
        raise LaunchError("L041", f"the command cannot be run: {error}", "", words[0]) from None
    if done.returncode:
        last = done.stderr.decode("utf-8", "replace").strip().splitlines()[-1:]
        reason = f": {last[0]}" if last else ""
        raise LaunchError("L041", f"the command exited with status {done.returncode}{reason}", "", words[0])
    return done.stdout.decode("utf-8", "replace")
