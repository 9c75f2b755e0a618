"""Makes the substitutions of ROS 1 launch files: `$(find …)`, `$(arg …)`, `$(eval …)` and others."""

from __future__ import annotations

import math
import os
import re
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from kbot.ros.launch.evaluation import BUILTINS, evaluated, joined
from kbot.ros.launch.launch_error import LaunchError
from kbot.ros.parameter_values import convert
from kbot.text.suggest import did_you_mean
from kbot.xacro.budget import Budget
from kbot.xacro.packages import PackageError, PackageNotFound, Packages
from kbot.xacro.ros_variables import ros_value

_MARK = re.compile(r"[$()]")
COMMANDS = ("find", "env", "optenv", "dirname", "anon", "arg", "eval")


@dataclass
class SubstitutionScope:
    """The values that substitutions can use.

    `share_of` returns the path that replaces the folder of an absent package.
    `anonymous` remembers the names that `$(anon …)` made. If it is None, such substitutions are not changed.
    """

    file: str
    packages: Packages
    arguments: Mapping[str, str]
    budget: Budget
    share_of: Callable[[PackageNotFound], str]
    anonymous: dict[str, str] | None = field(default_factory=dict)

    def resolve(self, text: str) -> str:
        """The text after substitution.

        Raises:
            LaunchError: L010 to L016.
        """
        if "$" not in text:
            return text
        if text.startswith("$(eval ") and text.endswith(")"):
            return self._eval(text[7:-1])
        # `find` comes last, because the path after it must be complete by then
        return self._replace(self._replace(text, finding=False), finding=True)

    def _replace(self, text: str, finding: bool) -> str:
        result: list[str] = []
        at = 0
        for start, end in _substitutions(text):
            whole = text[start:end]
            result.append(text[at:start])
            at = end
            word, *rest = whole[2:-1].split() or [""]
            if word == "eval":
                raise LaunchError(
                    "L015",
                    "$(eval …) must be the whole value",
                    "put the rest of the value into the expression",
                    whole,
                )
            if word not in COMMANDS:
                hint = did_you_mean(word, COMMANDS) or f"use one of: {', '.join(COMMANDS)}"
                raise LaunchError("L010", f"unknown substitution $({word})", hint, whole)
            value = self._command(word, rest, whole) if (word == "find") is finding else whole
            if finding and word == "find":
                value, at = _before_path(value, text, end)
            result.append(value)
        return joined([*result, text[at:]], self.budget)

    def _command(self, word: str, rest: list[str], whole: str) -> str:
        if word == "dirname":
            return self.dirname()
        if word == "optenv" and rest:
            return self.optenv(rest[0], " ".join(rest[1:]))
        if len(rest) != 1:
            raise LaunchError("L015", f"$({word} …) takes one name, not {len(rest)}", "", whole)
        if word == "anon":
            return whole if self.anonymous is None else self.anon(rest[0])
        lookups: dict[str, Callable[[str], str]] = {"find": self.find, "env": self.env, "arg": self.arg}
        if word not in lookups:
            raise LaunchError("L015", f"$({word} …) needs a name", "", whole)
        try:
            return lookups[word](rest[0])
        except LaunchError as fault:
            fault.piece = fault.piece or whole
            raise

    def find(self, name: str) -> str:
        try:
            return self.packages.find(name)
        except PackageError as error:
            if isinstance(error, PackageNotFound):
                return self.share_of(error)
            raise LaunchError("L012", error.problem, error.hint) from None

    def env(self, name: str) -> str:
        value = os.environ.get(name)
        if value is None:
            value = ros_value(name, version=1)
        if value is None:
            raise LaunchError(
                "L013", f"the environment variable {name} is not set", f"$(optenv {name} DEFAULT)"
            )
        return value

    def optenv(self, name: str, default: str = "") -> str:
        return os.environ.get(name, default)

    def anon(self, name: str) -> str:
        if self.anonymous is None:
            return f"$(anon {name})"
        return self.anonymous.setdefault(name, f"{name}_{os.getpid()}_{len(self.anonymous) + 1}")

    def dirname(self) -> str:
        return os.path.normpath(Path(self.file).absolute().parent)

    def arg(self, name: str) -> str:
        if name not in self.arguments:
            hint = did_you_mean(name, self.arguments) or f"declare it with <arg name='{name}'/>"
            raise LaunchError("L011", f"the argument '{name}' is not set", hint)
        return self.arguments[name]

    def _eval(self, expression: str) -> str:
        return evaluated(expression, _Names(self))


class _Names:
    """The names that `$(eval …)` can use: substitutions as functions, the module math, and the arguments."""

    def __init__(self, scope: SubstitutionScope) -> None:
        self.budget = scope.budget
        self._scope = scope
        self._known: dict[str, Any] = {  # Any: an expression evaluates to any value
            **{name: value for name, value in vars(math).items() if not name.startswith("_")},
            "true": True,
            "false": False,
            "anon": scope.anon,
            "dirname": scope.dirname,
            "env": scope.env,
            "find": scope.find,
            "optenv": scope.optenv,
            "arg": lambda name: convert(scope.arg(name), "auto"),
        }

    def lookup(self, name: str) -> Any:
        if name in self._known:
            return self._known[name]
        if name in self._scope.arguments:
            return convert(self._scope.arguments[name], "auto")
        if name in BUILTINS:  # after the arguments: in roslaunch, an argument hides a built-in function
            return BUILTINS[name]
        hint = did_you_mean(name, [*self._known, *self._scope.arguments, *BUILTINS])
        raise LaunchError("L014", f"the name '{name}' is not defined", hint, name)

    def assign(self, name: str, value: object) -> None:
        raise LaunchError("L014", f"an expression cannot set '{name}'", "", name)


def _before_path(folder: str, text: str, at: int) -> tuple[str, int]:
    """The text for `$(find …)`, up to the path that follows at `at`, and the offset of the rest of that path.

    roslaunch joins folder and path: it adds a missing slash, and a path with two slashes starts at the root.
    """
    slash = text.startswith("/", at)
    at += slash
    following = text[at : at + 1]
    if following in ("", " "):
        return folder, at
    return ("" if slash and following == "/" else f"{folder}/"), at


def _substitutions(text: str) -> list[tuple[int, int]]:
    """Start and end (exclusive) of each `$(…)`. One that is not closed is not a substitution.

    Raises:
        LaunchError: L015, a substitution contains `$` or `(`.
    """
    found: list[tuple[int, int]] = []
    at = text.find("$(")
    while at >= 0:
        mark = _MARK.search(text, at + 2)
        if mark is None:
            break
        stop = mark.start()
        if text[stop] != ")":
            piece = text[at : stop + 1]
            raise LaunchError(
                "L015", f"'{text[stop]}' is not allowed in $(…)", "substitutions cannot be nested", piece
            )
        if stop > at + 2:
            found.append((at, stop + 1))
        at = text.find("$(", stop)
    return found
