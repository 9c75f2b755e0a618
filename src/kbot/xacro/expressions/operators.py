"""Operators of expressions, by the names of their syntax trees' classes; they measure before they compute.

They give what Python's give; a bound that is reached raises a LimitFault.
"""

from __future__ import annotations

import math
import operator

from kbot.xacro.budget import SIZED, Budget

TYPE_CHECKING = False
if TYPE_CHECKING:
    from collections.abc import Callable
    from typing import Any

    from kbot.xacro.values import Value


def multiply(budget: Budget, a: Value, b: Value) -> Value:
    if type(a) is float or type(b) is float:
        return a * b
    if isinstance(a, int) and isinstance(b, int):
        budget.bits(a.bit_length() + b.bit_length())
    elif isinstance(b, int) and hasattr(a, "__len__"):
        budget.length(len(a) * b)
    elif isinstance(a, int) and hasattr(b, "__len__"):
        budget.length(len(b) * a)
    return budget.checked(a * b)


def power(budget: Budget, a: Value, b: Value) -> Value:
    if isinstance(a, int) and isinstance(b, int) and b > 0 and a not in (-1, 0, 1):
        budget.bits(math.log2(abs(a)) * b)
    return a**b


def shift(budget: Budget, a: Value, b: Value) -> Value:
    if isinstance(a, int) and isinstance(b, int) and a and b > 0:
        budget.bits(a.bit_length() + b)
    return budget.checked(a << b)


def modulo(budget: Budget, a: Value, b: Value) -> Value:
    if isinstance(a, str | bytes):
        pattern = a if isinstance(a, str) else a.decode("latin-1")
        budget.widths(pattern, b if isinstance(b, tuple) else (b,))
        budget.weigh(b)
        return budget.checked(a % b)
    return a % b


def contains(budget: Budget, a: Value, b: Value) -> bool:
    budget.measure(b)
    if isinstance(b, SIZED):
        budget.weigh(a)
        budget.weigh(b)
    return a in b


def compare(function: Callable[[Any, Any], Any]) -> Callable[[Budget, Value, Value], Value]:
    def bounded(budget: Budget, a: Value, b: Value) -> Value:
        if isinstance(a, SIZED) and isinstance(b, SIZED):
            budget.weigh(a)
            budget.weigh(b)
        return function(a, b)

    return bounded


def add(budget: Budget, a: Value, b: Value) -> Value:
    if type(a) is float or type(b) is float:
        return a + b
    return budget.checked(a + b)


def _plain(function: Callable[[Any, Any], Any]) -> Callable[[Budget, Value, Value], Value]:
    def bounded(budget: Budget, a: Value, b: Value) -> Value:
        return budget.checked(function(a, b))

    return bounded


BINARY: dict[str, Callable[[Budget, Value, Value], Value]] = {
    "Add": add,
    "Mult": multiply,
    "Pow": power,
    "LShift": shift,
    "Mod": modulo,
    "MatMult": _plain(operator.matmul),
    "BitOr": _plain(operator.or_),
    "BitAnd": _plain(operator.and_),
    "BitXor": _plain(operator.xor),
    "Sub": _plain(operator.sub),
    "RShift": _plain(operator.rshift),
    "FloorDiv": _plain(operator.floordiv),
}
COMPARE: dict[str, Callable[[Budget, Value, Value], Value]] = {
    "Eq": compare(operator.eq),
    "NotEq": compare(operator.ne),
    "Lt": compare(operator.lt),
    "LtE": compare(operator.le),
    "Gt": compare(operator.gt),
    "GtE": compare(operator.ge),
    "Is": lambda _, a, b: a is b,
    "IsNot": lambda _, a, b: a is not b,
    "In": contains,
    "NotIn": lambda budget, a, b: not contains(budget, a, b),
}
