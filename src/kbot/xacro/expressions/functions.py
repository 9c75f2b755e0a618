"""Calls of functions in expressions, refused or bounded where they could cost too much.

A bound that is reached raises a LimitFault, and what would lead out of plain data raises a Fault.
"""

from __future__ import annotations

import math
from collections.abc import Callable

from kbot.xacro.budget import SIZED, Budget
from kbot.xacro.expressions.string_methods import TEXT_METHODS
from kbot.xacro.faults import Fault
from kbot.xacro.values import TYPES, Value, attribute

TYPE_CHECKING = False
if TYPE_CHECKING:
    from typing import Any


def call(budget: Budget, function: Value, args: list[Value], named: dict[str, Value]) -> Value:
    """`function(*args, **named)`, refused or bounded where it could cost too much."""
    try:
        guard = _GUARDS.get(function)
    except TypeError:  # not hashable, so not a function either
        guard = None
    budget.charge(1)
    for arg in args:
        if type(arg) is not float:
            budget.measure(arg)
    for arg in named.values():
        budget.measure(arg)
    if guard is not None:
        return budget.checked(guard(budget, function, args, named))
    owner = getattr(function, "__self__", None)
    if owner is None and args and type(args[0]) in TYPES and hasattr(function, "__objclass__"):
        # a method taken from its type, as in str.upper(text)
        return call(budget, attribute(args[0], function.__name__), args[1:], named)
    if isinstance(owner, int) and function.__name__ == "to_bytes":
        budget.length(max((n for n in (*args, *named.values()) if isinstance(n, int)), default=1))
    if isinstance(owner, str | bytes | list | dict | set):
        return _method(budget, owner, function, args, named)
    return budget.checked(function(*args, **named))


def _method(
    budget: Budget, owner: Value, function: Value, args: list[Value], named: dict[str, Value]
) -> Value:
    name = function.__name__
    budget.measure(owner)
    if isinstance(owner, str | bytes):
        guard = TEXT_METHODS.get(name)
        return budget.checked(guard(budget, owner, args, named) if guard else function(*args, **named))
    if name == "sort":
        named = {key: _guarded(budget, value) for key, value in named.items()}
        budget.weigh(owner)
    if name in ("index", "count", "remove"):
        budget.weigh(owner)
    result = function(*args, **named)
    budget.length(len(owner))
    return budget.checked(result)


def _guarded(budget: Budget, function: Value) -> Value:
    """A function that another one will call, with its bounds."""
    if not callable(function):
        return function

    def bounded(*args: Value, **named: Value) -> Value:
        return call(budget, function, list(args), named)

    return bounded


Guard = Callable[[Budget, Value, list[Value], dict[str, Value]], Value]


def _calls_back(budget: Budget, function: Value, args: list[Value], named: dict[str, Value]) -> Value:
    for arg in args:
        budget.weigh(arg)
    args = [_guarded(budget, a) if callable(a) and not isinstance(a, type(None)) else a for a in args]
    named = {key: _guarded(budget, value) if key == "key" else value for key, value in named.items()}
    return function(*args, **named)


def _weighed(budget: Budget, function: Value, args: list[Value], named: dict[str, Value]) -> Value:
    for arg in args:
        budget.weigh(arg)
    return function(*args, **named)


def _range(budget: Budget, function: Value, args: list[Value], named: dict[str, Value]) -> Value:
    result = range(*args, **named)
    try:
        size = len(result)
    except OverflowError:
        size = budget.limits.steps + 1
    budget.charge(size)
    return result


def _type(budget: Budget, function: Value, args: list[Value], named: dict[str, Value]) -> Value:
    if len(args) != 1 or named:
        raise Fault("X191", "type() makes no new types here", "give it one argument")
    return type(args[0])


def _refused(budget: Budget, function: Value, args: list[Value], named: dict[str, Value]) -> Value:
    raise Fault("X191", f"{function.__name__}() is refused: it leads to Python's internals")


def _factorial(budget: Budget, function: Value, args: list[Value], named: dict[str, Value]) -> Value:
    for n in args:
        if isinstance(n, int) and n > 1:
            budget.bits(n * math.log2(n))
    return function(*args, **named)


def _combinations(budget: Budget, function: Value, args: list[Value], named: dict[str, Value]) -> Value:
    if args and all(isinstance(n, int) for n in args):
        n, k = abs(args[0]), abs(args[-1])
        budget.bits(min(n, k) * n.bit_length())
    return function(*args, **named)


def _round(budget: Budget, function: Value, args: list[Value], named: dict[str, Value]) -> Value:
    for digits in (*args[1:], *named.values()):
        if isinstance(digits, int):  # of a whole number it makes 10 to that power
            budget.bits(-digits * math.log2(10))
    return function(*args, **named)


def _product(budget: Budget, function: Value, args: list[Value], named: dict[str, Value]) -> Value:
    if function is math.prod and args:
        args = [list(args[0]), *args[1:]]
    factors = args[0] if function is math.prod and args else args
    budget.bits(sum(n.bit_length() for n in factors if isinstance(n, int)))
    return function(*args, **named)


def _sum(budget: Budget, function: Value, args: list[Value], named: dict[str, Value]) -> Value:
    if args:
        items = list(args[0])
        lengths = sum(len(item) for item in items if isinstance(item, SIZED))
        budget.length(lengths)
        budget.charge(len(items) * (1 + (lengths >> 3)))
        args = [items, *args[1:]]
    return sum(*args, **named)


_GUARDS: dict[Any, Guard] = {
    range: _range,
    type: _type,
    vars: _refused,
    str: _weighed,
    repr: _weighed,
    hash: _weighed,
    list: _weighed,
    set: _weighed,
    frozenset: _weighed,
    map: _calls_back,
    filter: _calls_back,
    sorted: _calls_back,
    min: _calls_back,
    max: _calls_back,
    sum: _sum,
    round: _round,
    math.factorial: _factorial,
    math.comb: _combinations,
    math.perm: _combinations,
    math.prod: _product,
    math.lcm: _product,
}
