"""Runs the `command=` of a parameter. KBot itself replaces xacro and cat; other commands need permission."""

from __future__ import annotations

import re
import subprocess
from collections.abc import Callable, Mapping
from pathlib import PurePath
from typing import TYPE_CHECKING

from kbot.ros.launch.includes import charge
from kbot.ros.launch.launch_error import LaunchError
from kbot.ros.launch.plan import RobotDescription
from kbot.ros.launch.quoting import split_words
from kbot.ros.launch.reporter import part_of, removal_of
from kbot.text import Diagnostic, Origin, Severity, read_source
from kbot.text.installed import find_file
from kbot.xacro import expand
from kbot.xacro.budget import Budget
from kbot.xacro.limits import Limits
from kbot.xacro.packages import Packages

if TYPE_CHECKING:
    from kbot.xacro import Expansion

_XACRO_FLAGS = {"--check-order", "--deps", "--just-deps", "--just-includes", "-q"}
_XACRO_VALUES = {"--verbosity", "-o"}
_TIMEOUT_S = 60.0
"""A command that takes longer fails."""
_COMMENT = re.compile(r"<!--.*?(?:-->|\Z)", re.DOTALL)

Note = Callable[[Diagnostic], None]


def run(
    command: str, packages: Packages, origin: Origin, note: Note, budget: Budget, allowed: bool
) -> tuple[str, RobotDescription | None]:
    """The output of a command and, if it prints a robot, which robot that is.

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
    if name in ("xacro", "xacro.py"):
        return _xacro(words, packages, origin, note, budget)
    if name == "cat" and len(words) == 2:
        text = read_source(words[1]).text
        return text, description_of(words[1], text)
    if not allowed:
        hint = "if you trust the launch file, add --allow-commands; without it, KBot runs only xacro and cat"
        raise LaunchError("L040", f"the command '{name}' is not run", hint, words[0])
    return _process(words), None


def description_of(path: str, text: str) -> RobotDescription | None:
    """The robot in the text of a file. None if the text is not a robot or must be expanded by xacro first."""
    is_robot = "<robot" in text and "xacro:" not in _COMMENT.sub("", text)
    return RobotDescription(path, {}) if is_robot else None


def expand_within(budget: Budget, file: str, arguments: Mapping[str, str], packages: Packages) -> Expansion:
    """Expand a description. The work is charged to the budget of the launch file.

    Raises:
        LaunchError: L070, all descriptions and files together exceed the budget.
    """
    limits = Limits(steps=max(budget.steps, 0))
    expansion = expand(file, arguments, packages=packages.beside(file), limits=limits, lenient=True)
    charge(budget, file, expansion.steps + (len(expansion.text) >> 3), "takes too many steps to expand")
    return expansion


def _xacro(
    words: list[str], packages: Packages, origin: Origin, note: Note, budget: Budget
) -> tuple[str, RobotDescription | None]:
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


def _process(words: list[str]) -> str:
    try:
        done = subprocess.run(words, capture_output=True, timeout=_TIMEOUT_S, check=False)
    except (OSError, subprocess.TimeoutExpired) as error:
        raise LaunchError("L041", f"the command cannot be run: {error}", "", words[0]) from None
    if done.returncode:
        last = done.stderr.decode("utf-8", "replace").strip().splitlines()[-1:]
        reason = f": {last[0]}" if last else ""
        raise LaunchError("L041", f"the command exited with status {done.returncode}{reason}", "", words[0])
    return done.stdout.decode("utf-8", "replace")
