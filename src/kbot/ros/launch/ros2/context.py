"""The state of a ROS 2 launch file while it runs, which its substitutions read."""

from __future__ import annotations

import math
import os
import re
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Protocol

from kbot.ros.launch import commands
from kbot.ros.launch.evaluation import BUILTINS, evaluated
from kbot.ros.launch.known_packages import STAND_IN_PACKAGES, share_of
from kbot.ros.launch.launch_error import LaunchError
from kbot.ros.launch.plan import Param, RobotDescription
from kbot.ros.launch.ros2.scratch import scratch_file
from kbot.text import Diagnostic, Origin
from kbot.xacro.budget import Budget
from kbot.xacro.packages import PackageNotFound, Packages

_ADDRESS = re.compile(r"(?:package|model|file)://[^\"']*/")
"""Where a mesh is, without its name."""


class Performed(Protocol):
    """A substitution."""

    def perform(self, context: LaunchContext) -> str:
        """Its text, now."""
        ...


@dataclass
class LaunchContext:
    """The state of a launch. `descriptions`: which robot file each expanded text came from."""

    file: str
    packages: Packages
    here: Origin
    note: Callable[[Diagnostic], None]
    budget: Budget
    allow_commands: bool = False
    launch_configurations: dict[str, str] = field(default_factory=dict)
    environment: dict[str, str] = field(default_factory=lambda: dict(os.environ))
    anonymous: dict[str, str] = field(default_factory=dict)
    namespace: str = "/"
    remaps: list[tuple[str, str]] = field(default_factory=list)
    parameters: dict[str, Any] = field(default_factory=dict)  # Any: what launch files give
    descriptions: dict[str, RobotDescription] = field(default_factory=dict)
    launched: Mapping[str, Param] = field(default_factory=dict)
    """The parameters of the nodes so far, by full name."""

    def perform_substitution(self, substitution: Performed) -> str:
        """The text of a substitution, as launch files ask for it."""
        return substitution.perform(self)

    def described(self, text: str) -> RobotDescription | None:
        """Which robot file a text came from, also where a launch file has changed it since: the addresses of
        its files alone, or more, and then it is a file of its own."""
        known = self.descriptions.get(text)
        if known is not None or "<robot" not in text:
            return known
        same = _without_folders(text)
        for own, description in self.descriptions.items():
            if _without_folders(own) == same:
                return description
        found = self.descriptions[text] = RobotDescription(scratch_file(text, ".urdf"), {})
        return found

    def begin_anew(self) -> None:
        """Forget what was set, as a group does that forwards nothing."""
        self.launch_configurations, self.environment = {}, dict(os.environ)
        self.namespace, self.remaps, self.parameters = "/", [], {}

    def share(self, package: str) -> str:
        """A package's share folder, or that which stands in for a package KBot knows.

        Raises:
            LaunchError: L012, no such package.
        """
        try:
            return str(self.packages.beside(self.file).find(package))
        except PackageNotFound as error:
            if package in STAND_IN_PACKAGES:
                return share_of(package)
            raise LaunchError("L012", f"the package '{package}' is not found", error.hint, package) from None

    def prefix(self, package: str) -> str:
        """Where a package is installed: two above its share folder. Raises as `share` does."""
        return str(Path(self.share(package)).parents[1])

    def has_resource(self, kind: str, name: str) -> str | bool:
        """The prefix of a package, of the kind `packages`, or no; nothing else is indexed here."""
        try:
            return self.prefix(name) if kind == "packages" else False
        except LaunchError:
            return False

    def command(self, text: str, origin: Origin | None) -> str:
        """What a command prints, where KBot stands in for it."""
        words = [word for word in text.split() if not word.startswith("-")]
        if words[:3] == ["ros2", "param", "get"] and len(words) == 5:
            return self._parameter(*words[3:])
        packages = self.packages.beside(self.file)
        where = origin or self.here
        output, description = commands.run(text, packages, where, self.note, self.budget, self.allow_commands)
        if description:
            self.descriptions[output] = description
        return output

    def _parameter(self, node: str, name: str) -> str:
        """What `ros2 param get` prints, with `--hide-type`."""
        found = self.launched.get(f"/{node.strip('/')}/{name}")
        if found is None:
            hint = "the node that has it stands before in the launch file"
            raise LaunchError("L041", f"no node {node} with the parameter '{name}' is launched yet", hint)
        return str(found.value)

    def evaluate(self, expression: str) -> str:
        """A Python expression's value as text; it can compute and nothing more."""
        return evaluated(expression, _Names(self.budget))


def _without_folders(text: str) -> str:
    return _ADDRESS.sub("", "".join(text.split()))


class _Names:
    """What a PythonExpression may name: mathematics and harmless builtins."""

    def __init__(self, budget: Budget) -> None:
        self.budget = budget
        self._known: dict[str, Any] = {
            name: value for name, value in vars(math).items() if not name.startswith("_")
        }
        self._known |= BUILTINS

    def lookup(self, name: str) -> Any:
        if name not in self._known:
            raise LaunchError(
                "L014", f"the name '{name}' is not defined", "a text needs quotes around it", name
            )
        return self._known[name]

    def assign(self, name: str, value: object) -> None:
        raise LaunchError("L014", f"an expression cannot set '{name}'", "", name)
