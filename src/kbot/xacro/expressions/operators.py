"""The operators of expressions, by the names of their syntax nodes.

They have the same results as Python's operators, but charge their work first. Exceeding a limit raises
LimitFault.
"""

from __future__ import annotations

import math
import operator

from kbot.xacro.budget import HASHED, SIZED, Budget

TYPE_CHECKING = False
if TYPE_CHECKING:
    from collections.abc import Callable
    from typing import Any

    from kbot.xacro.values import Value


def multiply(budget: Budget, a: Value, b: Value) -> Value:
    if type(a) is float or type(b) is float:
        return a * b
    if isinstance(a, int) and isinstance(b, int):
        digits, more = a.bit_length() >> 5, b.bit_length() >> 5
        if digits and more:
            budget.bits(a.bit_length() + b.bit_length())
            budget.charge(digits * more >> 10)
    elif isinstance(b, int) and hasattr(a, "__len__"):
        _repeat(budget, len(a) * b)
    elif isinstance(a, int) and hasattr(b, "__len__"):
        _repeat(budget, len(b) * a)
    return budget.checked(a * b)


def _repeat(budget: Budget, count: int) -> None:
    if count > 0:
        budget.length(count)
        budget.charge(count >> 4)


def power(budget: Budget, a: Value, b: Value) -> Value:
    if isinstance(a, int) and isinstance(b, int) and b > 0 and a not in (-1, 0, 1):
        bits = math.log2(abs(a)) * b
        budget.bits(bits)
        budget.charge((int(bits) >> 5) ** 2 >> 10)
    return budget.checked(a**b)


def shift(budget: Budget, a: Value, b: Value) -> Value:
    if isinstance(a, int) and isinstance(b, int) and a and b > 0:
        budget.bits(a.bit_length() + b)
    return budget.checked(a << b)


# Any: functions of Python's operators
def _divide(function: Callable[[Any, Any], Any]) -> Callable[[Budget, Value, Value], Value]:
    """A division. Its work grows with the square of the digits."""

    def bounded(budget: Budget, a: Value, b: Value) -> Value:
        if isinstance(a, int):
            budget.integer(a)
        return budget.checked(function(a, b))

    return bounded


_remainder = _divide(operator.mod)


def modulo(budget: Budget, a: Value, b: Value) -> Value:
    if isinstance(a, str | bytes):
        from kbot.xacro.expressions.formatting import percent  # rarely needed: start-up time

        return budget.checked(percent(budget, a, b))
    return _remainder(budget, a, b)


def contains(budget: Budget, a: Value, b: Value) -> bool:
    if isinstance(b, HASHED):
        budget.keys(len(b), (a,))
    elif isinstance(b, SIZED):
        budget.weigh(a)
        budget.weigh(b)
    elif isinstance(a, str | bytes) and isinstance(b, str | bytes):
        budget.charge(len(a) * len(b) >> 10)
        budget.measure(b)
    return a in b


def compare(function: Callable[[Any, Any], Any]) -> Callable[[Budget, Value, Value], Value]:
    def bounded(budget: Budget, a: Value, b: Value) -> Value:
        kind = type(a)
        if (kind is str or kind is bytes) and type(b) is kind:
            if len(a) > 64 and len(b) > 64:
                budget.charge(min(len(a), len(b)) >> 6)
        elif isinstance(a, SIZED) and isinstance(b, SIZED):
            budget.weigh(a)
            budget.weigh(b)
            _look_up(budget, a, b)
        return function(a, b)

    return bounded


def _look_up(budget: Budget, a: Value, b: Value) -> None:
    """Charge finding the items of one container in another, if both use hashes."""
    if isinstance(a, HASHED) and isinstance(b, HASHED):
        budget.keys(len(a), b)
        budget.keys(len(b), a)


def add(budget: Budget, a: Value, b: Value) -> Value:
    if type(a) is float or type(b) is float:
        return a + b
    return budget.checked(a + b)


def _plain(function: Callable[[Any, Any], Any]) -> Callable[[Budget, Value, Value], Value]:
    def bounded(budget: Budget, a: Value, b: Value) -> Value:
        _look_up(budget, a, b)
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
    "FloorDiv": _divide(operator.floordiv),
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
