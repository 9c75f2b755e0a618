"""Evaluates the commands of `$(…)`: arg, find, env, optenv, dirname, cwd, anon, eval."""

from __future__ import annotations

import math
import os
import re
from collections.abc import Callable

from kbot.text.suggest import did_you_mean
from kbot.xacro.expressions.operations import CallFrame
from kbot.xacro.templates import expression
from kbot.xacro.values import Value
from kbot.xacro.xacro_error import XacroError

TYPE_CHECKING = False
if TYPE_CHECKING:
    from kbot.xacro.run import Run

_CONSTANTS: dict[str, object] = {
    "true": True, "false": False, "True": True, "False": False,
    "list": list, "dict": dict, "map": map, "str": str, "float": float, "int": int,
    **{name: value for name, value in vars(math).items() if not name.startswith("_")},
}  # fmt: skip

ABSENT = "absent package"
"""The key of the error of a package that is not found begins with this."""


def substitute(content: str, run: Run) -> str:
    """The value of `$(content)`.

    Raises:
        XacroError: X110 unknown command, X111 wrong number of words, X112 undefined argument, X113 unset
            environment variable, X114 package not found, X115 a bracket or dollar sign in a wrong place.
    """
    if content == "cwd":
        return os.path.abspath(run.root_dir)
    if content.startswith("eval "):
        return _evaluate(content[5:], run)
    if not content:
        return "$()"
    if not content.isprintable() or any(mark in content for mark in "$()"):
        return _scan(f"$({content})", run, _COMMANDS)
    result = _command(content, run, _COMMANDS)
    # an argument's value may contain $(find …)
    return _scan(result, run, {"find": _find}) if "$" in result else result


def convert(text: str) -> Value:
    """The value of an argument in `$(eval …)`: a number, a truth value, or the text."""
    try:
        return float(text) if "." in text else int(text)
    except ValueError:
        return {"true": True, "false": False}.get(text.lower(), text)


_COMPUTES = re.compile(r"[\w)] *[-+*/] *[\w(]")
"""An operator between two values, as only expressions have."""

Command = Callable[["Run", list[str]], str]


def _command(content: str, run: Run, commands: dict[str, Command]) -> str:
    words = [word for word in content.split(" ") if word]
    if not words:
        raise XacroError("X110", "'$( )' contains no command", f"one of {', '.join(_COMMANDS)}")
    name = words[0]
    if name not in _COMMANDS:
        hint = did_you_mean(name, _COMMANDS) or f"the commands are {', '.join(_COMMANDS)}, eval and cwd"
        if _COMPUTES.search(content):
            hint = f"write ${{{content}}} for an expression"
        raise XacroError("X110", f"unknown command '{name}' in '$(…)'", hint)
    command = commands.get(name)
    return f"$({content})" if command is None else command(run, words[1:])


def _scan(text: str, run: Run, commands: dict[str, Command]) -> str:
    """Replace every `$(…)` of a text. Brackets cannot be nested."""
    out, at = [], 0
    while (start := text.find("$(", at)) >= 0:
        end = text.find(")", start)
        content = text[start + 2 : end] if end >= 0 else text[start + 2 :]
        if "$" in content or "(" in content:
            raise XacroError("X115", f"'$' and '(' are not allowed within '$(…)': '$({content})'")
        if end < 0:
            break
        out += [text[at:start], _command(content, run, commands) if content else "$()"]
        at = end + 1
    return "".join(out) + text[at:]


def _arg(run: Run, words: list[str]) -> str:
    if len(words) != 1:
        raise XacroError("X111", f"$(arg NAME) takes one name, not {len(words)}")
    return run.argument(words[0])


def _find(run: Run, words: list[str]) -> str:
    if len(words) != 1:
        raise XacroError("X111", f"$(find PACKAGE) takes one name, not {len(words)}")
    from kbot.xacro.packages import (  # not every description has packages: start-up time
        AmbiguousPackage,
        PackageNotFound,
    )

    try:
        return run.packages.find(words[0])
    except AmbiguousPackage as error:
        raise XacroError("X114", error.problem, error.hint, key=("packages", error.name)) from None
    except PackageNotFound as error:
        raise XacroError("X114", error.problem, error.hint, key=(ABSENT, error.name)) from None


def _env(run: Run, words: list[str]) -> str:
    if len(words) != 1:
        raise XacroError("X111", f"$(env VARIABLE) takes one name, not {len(words)}")
    value = os.environ.get(words[0])
    if value is None:
        from kbot.xacro.ros_variables import ros_value  # rarely needed: start-up time

        value = ros_value(words[0])
    if value is None:
        hint = (
            did_you_mean(words[0], os.environ) or f"set it, or give a default: $(optenv {words[0]} default)"
        )
        raise XacroError("X113", f"the environment variable '{words[0]}' is not set", hint)
    return value


def _optenv(run: Run, words: list[str]) -> str:
    if not words:
        raise XacroError("X111", "$(optenv VARIABLE default) takes a name")
    return os.environ.get(words[0], " ".join(words[1:]))


def _dirname(run: Run, words: list[str]) -> str:
    return os.path.abspath(os.path.dirname(run.file or ""))


def _anon(run: Run, words: list[str]) -> str:
    """A unique name. The same word gives the same name in every run, so that results are reproducible."""
    if len(words) != 1:
        raise XacroError("X111", f"$(anon NAME) takes one name, not {len(words)}")
    import hashlib  # rarely needed: start-up time

    seed = f"{run.files[0]}\0{words[0]}"
    return f"{words[0]}_{hashlib.sha256(seed.encode()).hexdigest()[:12]}"


_COMMANDS: dict[str, Command] = {
    "find": _find, "env": _env, "optenv": _optenv, "dirname": _dirname, "arg": _arg, "anon": _anon,
}  # fmt: skip


class _Names:
    """The names within `$(eval …)`: functions, constants, and all arguments."""

    def __init__(self, run: Run) -> None:
        self.run = run
        self.budget = run.budget

    def lookup(self, name: str) -> Value:
        run = self.run
        functions: dict[str, Callable[..., Value]] = {
            "arg": lambda name: convert(run.argument(name)),
            "find": lambda name: _find(run, [name]),
            "env": lambda name: _env(run, [name]),
            "optenv": lambda name, default="": os.environ.get(name, default),
            "dirname": lambda: _dirname(run, []),
        }
        if name in functions:
            return functions[name]
        if name in _CONSTANTS:
            return _CONSTANTS[name]
        return convert(run.argument(name))

    def assign(self, name: str, value: Value) -> None:
        raise XacroError("X191", "assignments are not allowed within $(eval …)")


def _evaluate(source: str, run: Run) -> str:
    if "__" in source:
        raise XacroError("X191", "two underscores in a row are not allowed within $(eval …)")
    return run.budget.text(expression(source, CallFrame(_Names(run), {})))
