"""The state of a ROS 2 launch file while it runs. Substitutions read it."""

from __future__ import annotations

import math
import os
import re
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Protocol

from kbot.ros.launch import commands
from kbot.ros.launch.absent_packages import AbsentPackages
from kbot.ros.launch.evaluation import BUILTINS, evaluated
from kbot.ros.launch.known_packages import STAND_IN_PACKAGES
from kbot.ros.launch.launch_error import LaunchError, LaunchPackageError
from kbot.ros.launch.plan import Param, RobotDescription
from kbot.ros.launch.ros2.places import catches, here
from kbot.ros.launch.ros2.scratch import scratch_file
from kbot.text import Diagnostic, Origin
from kbot.xacro.budget import Budget
from kbot.xacro.packages import PackageError, PackageNotFound, Packages

_ADDRESS = re.compile(r"(?:package|model|file)://[^\"']*/")
"""The folder in the address of a mesh."""


class Performable(Protocol):
    """A substitution."""

    def perform(self, context: LaunchContext) -> str:
        """The current text of the substitution."""
        ...


@dataclass
class LaunchContext:
    """The state of a launch. `descriptions` maps each expanded text to the robot file that it came from."""

    file: str
    packages: Packages
    here: Origin
    note: Callable[[Diagnostic], None]
    budget: Budget
    absent: AbsentPackages
    allow_commands: bool = False
    launch_configurations: dict[str, str] = field(default_factory=dict)
    environment: dict[str, str] = field(default_factory=lambda: dict(os.environ))
    anonymous: dict[str, str] = field(default_factory=dict)
    namespace: str = "/"
    remaps: list[tuple[str, str]] = field(default_factory=list)
    parameters: dict[str, Any] = field(default_factory=dict)  # Any: a value of any type
    descriptions: dict[str, RobotDescription] = field(default_factory=dict)
    launched: Mapping[str, Param] = field(default_factory=dict)
    """The parameters of the nodes before the current action, by full name."""

    def perform_substitution(self, substitution: Performable) -> str:
        """The text of a substitution. Python launch files call this method."""
        return substitution.perform(self)

    def described(self, text: str) -> RobotDescription | None:
        """The robot file that a text came from. None if the text is not a robot.

        A launch file can change the text. If it changed only the folders of mesh files, the robot file is
        still known. After other changes, the text is written to a new file.
        """
        known = self.descriptions.get(text)
        if known is not None or "<robot" not in text:
            return known
        same = _without_folders(text)
        for own, description in self.descriptions.items():
            if _without_folders(own) == same:
                return description
        found = self.descriptions[text] = RobotDescription(scratch_file(text, ".urdf"), {})
        return found

    def reset(self) -> None:
        """Clear the state, for a group that does not forward it."""
        self.launch_configurations, self.environment = {}, dict(os.environ)
        self.namespace, self.remaps, self.parameters = "/", [], {}

    def share(self, package: str, origin: Origin | None = None) -> str:
        """The share folder of a package that is used at `origin`, by default at the current line.

        For a package that is not found, it is a folder that does not exist.

        Raises:
            LaunchError: L012, several packages have this name; or the package is not found, and the launch
                file catches this error.
        """
        try:
            return str(self.packages.beside(self.file).find(package))
        except PackageNotFound as error:
            if package not in STAND_IN_PACKAGES and catches(LaunchPackageError):
                raise LaunchPackageError("L012", error.problem, error.hint, package) from None
            return self.absent.share_of(error, origin or here() or self.here)
        except PackageError as error:
            raise LaunchPackageError("L012", error.problem, error.hint, package) from None

    def prefix(self, package: str, origin: Origin | None = None) -> str:
        """The install prefix of a package, two folders above its share folder. Raises the errors of
        `share`."""
        return str(Path(self.share(package, origin)).parents[1])

    def has_resource(self, kind: str, name: str) -> str | bool:
        """The prefix of a resource of the kind `packages`, or False. KBot does not index other kinds."""
        is_known = name in STAND_IN_PACKAGES or self.packages.beside(self.file).folder(name) is not None
        return self.prefix(name) if kind == "packages" and is_known else False

    def command(self, text: str, origin: Origin | None) -> str:
        """The output of a command. KBot itself replaces xacro, cat and `ros2 param get`."""
        words = [word for word in text.split() if not word.startswith("-")]
        if words[:3] == ["ros2", "param", "get"] and len(words) == 5:
            return self._parameter(*words[3:])
        packages = self.packages.beside(self.file)
        where = origin or self.here
        output, description = commands.run(
            text, packages, where, self.note, self.budget, self.allow_commands, self.environment
        )
        if description:
            self.descriptions[output] = description
        return output

    def _parameter(self, node: str, name: str) -> str:
        """The output of `ros2 param get --hide-type`."""
        found = self.launched.get(f"/{node.strip('/')}/{name}")
        if found is None:
            hint = "put that node earlier in the launch file"
            raise LaunchError("L041", f"no earlier node {node} has the parameter '{name}'", hint)
        return str(found.value)

    def evaluate(self, expression: str) -> str:
        """The value of a Python expression, as text. The expression can only compute."""
        return evaluated(expression, _Names(self.budget))


def _without_folders(text: str) -> str:
    """A description from its root on, without white space and the folders of mesh files. What is before the
    root, and white space, differ between the methods that print a document."""
    return _ADDRESS.sub("", "".join(text[max(text.find("<robot"), 0) :].split()))


class _Names:
    """The names that a PythonExpression can use: the module math and harmless built-in functions."""

    def __init__(self, budget: Budget) -> None:
        self.budget = budget
        self._known: dict[str, Any] = {
            name: value for name, value in vars(math).items() if not name.startswith("_")
        }
        self._known |= BUILTINS

    def lookup(self, name: str) -> Any:
        if name not in self._known:
            raise LaunchError(
                "L014", f"the name '{name}' is not defined", "if it is a string, put it in quotes", name
            )
        return self._known[name]

    def assign(self, name: str, value: object) -> None:
        raise LaunchError("L014", f"an expression cannot set '{name}'", "", name)
