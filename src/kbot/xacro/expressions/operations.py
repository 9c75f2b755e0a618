"""Types and closures that the modules of the compiler share.

A closure takes an environment with `lookup(name)`, `assign(name, value)` and `budget`, and returns a value.
"""

from __future__ import annotations

from collections.abc import Callable

from kbot.xacro.expressions import operators
from kbot.xacro.names import FUNCTIONS
from kbot.xacro.values import Value
from kbot.xacro.xacro_error import XacroError

TYPE_CHECKING = False
if TYPE_CHECKING:
    from typing import Protocol

    from kbot.xacro.budget import Budget

    class Environment(Protocol):
        """Looks up and assigns names."""

        @property
        def budget(self) -> Budget: ...
        def lookup(self, name: str) -> Value: ...
        def assign(self, name: str, value: Value) -> None: ...


Closure = Callable[[Value], Value]


class InvalidExpression(Exception):
    """A syntax error. `column` (0-based) is its place in the expression, or None if it is unknown."""

    def __init__(self, message: str, column: int | None = None) -> None:
        super().__init__(message)
        self.column = column


class CallFrame:
    """The variables of a comprehension or lambda function. They hide those of the enclosing environment."""

    __slots__ = ("budget", "outer", "variables")

    def __init__(self, outer: Environment, variables: dict[str, Value]) -> None:
        self.outer = outer
        self.budget = outer.budget
        self.variables = variables

    def lookup(self, name: str) -> Value:
        variables = self.variables
        return variables[name] if name in variables else self.outer.lookup(name)

    def assign(self, name: str, value: Value) -> None:
        self.outer.assign(name, value)


def refuse_private(name: str) -> None:
    """Raise XacroError for a name that is reserved for Python."""
    if name.startswith("__"):
        raise XacroError(
            "X191",
            f"the name '{name}' is not allowed: names with two leading underscores are reserved for Python",
        )


def name_closure(identifier: str) -> Closure:
    """The closure of a name."""
    refuse_private(identifier)
    return lambda env: env.lookup(identifier)


def function_closure(identifier: str) -> Closure:
    """The closure of a function's name."""
    refuse_private(identifier)

    def function(env: Environment) -> Value:
        try:
            return env.lookup(identifier)
        except XacroError as fault:
            if fault.code != "X103" or fault.problem is not None:  # the name exists, but has an error
                raise
        from kbot.text.suggest import did_you_mean  # only for an error: start-up time

        near = did_you_mean(identifier, FUNCTIONS)
        unknown = XacroError(
            "X103", f"unknown function '{identifier}'", near or "", key=("undefined", identifier)
        )
        unknown.near = bool(near)
        raise unknown

    return function


_FLOATS = {"Sub": float.__sub__, "Add": float.__add__, "Mult": float.__mul__}


def operation(kind: str, left: Closure, right: Closure) -> Closure:
    """The closure of a binary operator, by the name of its syntax tree's class."""
    if kind == "Div":  # a quotient has a fixed size
        return lambda env: left(env) / right(env)
    function = operators.BINARY[kind]
    direct = _FLOATS.get(kind)
    if direct is None:
        return lambda env: function(env.budget, left(env), right(env))

    def arithmetic(env: Environment) -> Value:
        a, b = left(env), right(env)
        if type(a) is float and type(b) is float:
            return direct(a, b)
        return function(env.budget, a, b)

    return arithmetic


def negation(operand: Closure) -> Closure:
    """The closure of a minus sign."""

    def negative(env: Environment) -> Value:
        value = operand(env)
        return -value if type(value) is float else env.budget.checked(-value)

    return negative


def comparison(kind: str, left: Closure, right: Closure) -> Closure:
    """The closure of a comparison, by the name of its syntax tree's class."""
    function = operators.COMPARE[kind]
    return lambda env: function(env.budget, left(env), right(env))


def item(budget: Budget, owner: Value, index: Value) -> Value:
    """`owner[index]`."""
    if isinstance(owner, type):
        raise TypeError(f"type '{owner.__name__}' is not subscriptable here")
    if (type(index) is not str or len(index) > 64) and isinstance(owner, dict):
        budget.keys(len(owner), (index,))
    return owner[index]
