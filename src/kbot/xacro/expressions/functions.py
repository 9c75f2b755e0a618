"""Executes calls in expressions, after charging their costs (see `costs`)."""

from __future__ import annotations

from types import FunctionType, MethodDescriptorType, MethodType

from kbot.xacro.budget import Budget
from kbot.xacro.expressions.costs import FUNCTIONS, METHODS, Cost, measured
from kbot.xacro.values import Value, attribute
from kbot.xacro.xacro_error import XacroError


def call(budget: Budget, function: Value, args: list[Value], named: dict[str, Value]) -> Value:
    """`function(*args, **named)`.

    Raises:
        LimitFault: the call is too expensive.
        XacroError: X191, the function gives access to more than plain data.
    """
    if type(function) is MethodDescriptorType:  # a method taken from its type, as in str.upper(text)
        if not args or not isinstance(args[0], function.__objclass__):
            raise TypeError(f"{function.__qualname__}() needs a {function.__objclass__.__name__} to work on")
        function, args = attribute(args[0], function.__name__), args[1:]
    owner = getattr(function, "__self__", None)
    cost = _cost(function, owner)
    budget.charge(1)
    instead = cost(budget, owner, args, named)
    result = (instead or function)(*args, **named)
    if isinstance(owner, list | dict | set):  # the call may have made it longer
        budget.length(len(owner))
    return budget.checked(result)


def _cost(function: Value, owner: Value) -> Cost:
    if not callable(function):
        raise TypeError(f"'{type(function).__name__}' object is not callable")
    known = FUNCTIONS.get(function)
    if known is not None:
        return known
    if isinstance(function, FunctionType | MethodType):  # a lambda function, or a function of KBot
        return measured
    kind = owner if isinstance(owner, type) else type(owner)
    for base in kind.__mro__:
        methods = METHODS.get(base)
        if methods is not None:
            return methods.get(function.__name__, measured)
    raise XacroError("X191", f"{getattr(function, '__name__', 'it')}() cannot be called from an expression")
