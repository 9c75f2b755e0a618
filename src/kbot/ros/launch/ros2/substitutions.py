"""The substitutions of ROS 2 launch files: values that are known only when the file runs.

Names and arguments are those of `launch.substitutions` and `launch_ros.substitutions`.
"""

from __future__ import annotations

import math
import os
from collections.abc import Iterable
from pathlib import Path

from kbot.ros.launch.evaluation import joined
from kbot.ros.launch.launch_error import LaunchError
from kbot.ros.launch.ros2.context import LaunchContext
from kbot.ros.launch.ros2.places import here
from kbot.text import read_source
from kbot.text.suggest import did_you_mean
from kbot.xacro.ros_variables import ros_value


class Substitution:
    """A text that is computed while the launch file runs."""

    def perform(self, context: LaunchContext) -> str:
        raise NotImplementedError


def as_substitution(value: object) -> Substitution:
    """The substitution for a value: a substitution, a text, a number, or a sequence of those."""
    if isinstance(value, Substitution):
        return value
    if isinstance(value, list | tuple):
        return Sequence(value)
    return TextSubstitution(text=str(value))


def performed(value: object, context: LaunchContext) -> str:
    """The text of a value that can be a substitution."""
    return as_substitution(value).perform(context)


def is_true(text: str) -> bool:
    """The truth value of a text.

    Raises:
        LaunchError: L005, it is neither true nor false.
    """
    word = text.strip().lower()
    if word in ("true", "1"):
        return True
    if word in ("false", "0"):
        return False
    raise LaunchError("L005", f"'{text}' is neither true nor false", "use true, false, 1 or 0")


class TextSubstitution(Substitution):
    def __init__(self, *, text: str) -> None:
        self.text = text

    def perform(self, context: LaunchContext) -> str:
        return self.text


class Sequence(Substitution):
    """The texts of several substitutions, joined."""

    def __init__(self, parts: Iterable[object]) -> None:
        self.parts = [as_substitution(part) for part in parts]

    def perform(self, context: LaunchContext) -> str:
        return joined([part.perform(context) for part in self.parts], context.budget)


class CommandLine(Sequence):
    """A command line, which has quotes and is split into words later."""


class LaunchConfiguration(Substitution):
    def __init__(self, variable_name: object, *, default: object = None) -> None:
        self.name, self.default = as_substitution(variable_name), default
        self.origin = here()

    def perform(self, context: LaunchContext) -> str:
        name = self.name.perform(context)
        if name in context.launch_configurations:
            return context.launch_configurations[name]
        if self.default is not None:
            return performed(self.default, context)
        hint = did_you_mean(name, context.launch_configurations) or f"declare the launch argument '{name}'"
        raise LaunchError("L011", f"the launch configuration '{name}' is not set", hint, name)


class PathJoinSubstitution(Substitution):
    def __init__(self, substitutions: Iterable[object]) -> None:
        self.parts = [as_substitution(part) for part in substitutions]

    def perform(self, context: LaunchContext) -> str:
        parts = [part.perform(context) for part in self.parts]
        joined(parts, context.budget)
        return str(Path(*parts))

    def __truediv__(self, other: object) -> PathJoinSubstitution:
        return PathJoinSubstitution([*self.parts, other])


class PathSubstitution(PathJoinSubstitution):
    def __init__(self, path: object) -> None:
        super().__init__([path])


class FindPackageShare(Substitution):
    def __init__(self, package: object) -> None:
        self.package = as_substitution(package)
        self.origin = here()

    def perform(self, context: LaunchContext) -> str:
        return context.share(self.package.perform(context), self.origin)

    def __truediv__(self, other: object) -> PathJoinSubstitution:
        return PathJoinSubstitution([self, other])


class FindPackagePrefix(FindPackageShare):
    def perform(self, context: LaunchContext) -> str:
        return context.prefix(self.package.perform(context), self.origin)


class Command(Substitution):
    def __init__(self, command: object, *, on_stderr: object = "fail") -> None:
        self.command = as_substitution(command)
        self.origin = here()

    def perform(self, context: LaunchContext) -> str:
        return context.command(self.command.perform(context), self.origin)


class FindExecutable(Substitution):
    def __init__(self, *, name: object) -> None:
        self.name = as_substitution(name)

    def perform(self, context: LaunchContext) -> str:
        return self.name.perform(context)


ExecutableInPackage = FindExecutable


class EnvironmentVariable(Substitution):
    def __init__(self, name: object, *, default_value: object = None) -> None:
        self.name, self.default = as_substitution(name), default_value

    def perform(self, context: LaunchContext) -> str:
        name = self.name.perform(context)
        if name in context.environment:
            return context.environment[name]
        if self.default is not None:
            return performed(self.default, context)
        value = ros_value(name)
        if value is not None:
            return value
        hint = f"set it: {name}=VALUE kbot launch …"
        raise LaunchError("L013", f"the environment variable {name} is not set", hint, name)


class PythonExpression(Substitution):
    def __init__(self, expression: object, python_modules: Iterable[object] = ("math",)) -> None:
        self.expression = as_substitution(expression)

    def perform(self, context: LaunchContext) -> str:
        return context.evaluate(self.expression.perform(context))


class ThisLaunchFile(Substitution):
    def perform(self, context: LaunchContext) -> str:
        return str(Path(context.file).absolute())


class ThisLaunchFileDir(Substitution):
    def perform(self, context: LaunchContext) -> str:
        return str(Path(context.file).absolute().parent)


class AnonName(Substitution):
    def __init__(self, name: object) -> None:
        self.name = as_substitution(name)

    def perform(self, context: LaunchContext) -> str:
        name = self.name.perform(context)
        return context.anonymous.setdefault(name, f"{name}_{os.getpid()}_{len(context.anonymous) + 1}")


class NotSubstitution(Substitution):
    def __init__(self, value: object) -> None:
        self.value = as_substitution(value)

    def perform(self, context: LaunchContext) -> str:
        return str(not is_true(self.value.perform(context))).lower()


class FileContent(Substitution):
    def __init__(self, path: object) -> None:
        self.path = as_substitution(path)

    def perform(self, context: LaunchContext) -> str:
        return read_source(self.path.perform(context)).text


class Parameter(Substitution):
    """The value of a parameter that SetParameter set."""

    def __init__(self, name: object, *, default: object = None) -> None:
        self.name, self.default = as_substitution(name), default

    def perform(self, context: LaunchContext) -> str:
        name = self.name.perform(context)
        if name in context.parameters:
            return context.budget.text(context.parameters[name].value)
        if self.default is not None:
            return performed(self.default, context)
        hint = did_you_mean(name, context.parameters)
        raise LaunchError("L011", f"the parameter '{name}' is not set", hint, name)


class LaunchLogDir(Substitution):
    def perform(self, context: LaunchContext) -> str:
        folder = context.environment.get("ROS_LOG_DIR")
        return folder or str(Path(context.environment.get("ROS_HOME", "~/.ros")).expanduser() / "log")


class _Several(Substitution):
    def __init__(self, *values: object) -> None:
        self.values = [as_substitution(value) for value in values]

    def truths(self, context: LaunchContext) -> list[bool]:
        """The truth values of all, so that an invalid value is reported whatever the others are."""
        return [is_true(value.perform(context)) for value in self.values]


class AnySubstitution(_Several):
    def perform(self, context: LaunchContext) -> str:
        return str(any(self.truths(context))).lower()


class AllSubstitution(_Several):
    def perform(self, context: LaunchContext) -> str:
        return str(all(self.truths(context))).lower()


class OrSubstitution(AnySubstitution):
    def __init__(self, left: object, right: object) -> None:
        super().__init__(left, right)


class AndSubstitution(AllSubstitution):
    def __init__(self, left: object, right: object) -> None:
        super().__init__(left, right)


class _Pair(Substitution):
    def __init__(self, left: object, right: object) -> None:
        self.left, self.right = as_substitution(left), as_substitution(right)

    def texts(self, context: LaunchContext) -> tuple[str, str]:
        return self.left.perform(context), self.right.perform(context)


def _equal(left: str, right: str) -> bool:
    """Whether two texts are the same truth value, the same number, or the same text."""
    words = ("true", "1", "false", "0")
    if left.lower() in words and right.lower() in words:
        return is_true(left) == is_true(right)
    try:
        return math.isclose(float(left), float(right))
    except ValueError:
        return left == right


class EqualsSubstitution(_Pair):
    def perform(self, context: LaunchContext) -> str:
        return str(_equal(*self.texts(context))).lower()


class NotEqualsSubstitution(_Pair):
    def perform(self, context: LaunchContext) -> str:
        return str(not _equal(*self.texts(context))).lower()


class IfElseSubstitution(Substitution):
    def __init__(self, condition: object, if_value: object = "", else_value: object = "") -> None:
        self.condition, self.if_value, self.else_value = map(
            as_substitution, (condition, if_value, else_value)
        )

    def perform(self, context: LaunchContext) -> str:
        chosen = self.if_value if is_true(self.condition.perform(context)) else self.else_value
        return chosen.perform(context)
