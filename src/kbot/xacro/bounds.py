"""What expressions may do, and how much of it: operators and calls that count and measure first.

Nothing here lets an expression compute something else than Python would; a bound that is reached
raises a LimitFault, and what would lead out of plain data raises a Fault.
"""

from __future__ import annotations

import math
import operator
import re
from collections.abc import Callable, Iterator, Sequence

from kbot.xacro.faults import Fault, LimitFault
from kbot.xacro.limits import Limits
from kbot.xacro.values import TYPES, Value, attribute

TYPE_CHECKING = False
if TYPE_CHECKING:
    from typing import Any

_RAISE_HINT = "raise the bound with Limits({name}=…) if the description is to be trusted"
_WIDTH = re.compile(r"\d{4,}|\*")
_SIZED = (list, tuple, dict, set, frozenset, range)


class Budget:
    """What is left of the steps of one expansion, and how large a value may be."""

    def __init__(self, limits: Limits) -> None:
        self.limits = limits
        self.steps = limits.steps
        self.function_depth = limits.function_depth

    def exceeded(self, name: str, what: str) -> LimitFault:
        bound = getattr(self.limits, name)
        return LimitFault("X190", f"{what} (the bound is {bound:,})", _RAISE_HINT.format(name=name))

    def charge(self, steps: int) -> None:
        """Take steps from what is left."""
        self.steps -= steps
        if self.steps < 0:
            raise self.exceeded("steps", "the expressions take too many steps")

    def length(self, count: int) -> None:
        """Refuse a text or list of so many items."""
        if count > self.limits.length:
            raise self.exceeded("length", f"an expression makes a text or list of {count:,} items")

    def bits(self, count: float) -> None:
        """Refuse a whole number of so many bits."""
        if count > self.limits.bits:
            raise self.exceeded("bits", "an expression makes too large a whole number")

    def checked(self, value: Value) -> Value:
        """The value, where it is not too large."""
        kind = type(value)
        if kind is float or kind is bool or value is None:
            return value
        if kind is int:
            if value.bit_length() > self.limits.bits:
                self.bits(value.bit_length())
        elif isinstance(value, str | bytes):
            size = len(value)
            if size > 64:
                self.length(size)
                self.charge(size >> 6)
        elif isinstance(value, _SIZED):
            self.length(len(value))
            self.charge(len(value) >> 2)
        return value

    def weigh(self, value: Value) -> None:
        """Count everything within nested lists and dictionaries, shared parts as often as they show."""
        if not isinstance(value, _SIZED) or isinstance(value, range):
            return
        left, path = self.steps, 0
        pending: list[Iterator[Value]] = [iter((value,))]
        while pending:
            item = next(pending[-1], pending)
            if item is pending:
                pending.pop()
                continue
            left -= 1
            if isinstance(item, str):
                left -= len(item) >> 6
            elif isinstance(item, dict):
                pending.append(iter([*item.keys(), *dict.values(item)]))
            elif isinstance(item, _SIZED) and not isinstance(item, range):
                pending.append(list.__iter__(item) if isinstance(item, list) else iter(item))
            path = max(path, len(pending))
            if left < 0 or path > 200:
                raise self.exceeded("steps", "a nested list or dictionary is too large")
        self.steps = left

    def text(self, value: Value) -> str:
        """`str(value)`."""
        if type(value) is str:
            return value
        self.weigh(value)
        return str(value)


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
        _widths(budget, pattern, b if isinstance(b, tuple) else (b,))
        budget.weigh(b)
        return budget.checked(a % b)
    return a % b


def _widths(budget: Budget, pattern: str, values: Sequence[Value]) -> None:
    for match in _WIDTH.findall(pattern):
        widths = [v for v in values if isinstance(v, int)] if match == "*" else [int(match)]
        budget.length(max(map(abs, widths), default=0))


def contains(budget: Budget, a: Value, b: Value) -> bool:
    _measure(budget, b)
    if isinstance(b, _SIZED):
        budget.weigh(a)
        budget.weigh(b)
    return a in b


def compare(function: Callable[[Any, Any], Any]) -> Callable[[Budget, Value, Value], Value]:
    def bounded(budget: Budget, a: Value, b: Value) -> Value:
        if isinstance(a, _SIZED) and isinstance(b, _SIZED):
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


def _measure(budget: Budget, value: Value) -> None:
    if isinstance(value, _SIZED):
        budget.charge(len(value))
    elif isinstance(value, str | bytes):
        budget.charge(len(value) >> 4)


def call(budget: Budget, function: Value, args: list[Value], named: dict[str, Value]) -> Value:
    """`function(*args, **named)`, refused or bounded where it could cost too much."""
    try:
        guard = _GUARDS.get(function)
    except TypeError:  # not hashable, so not a function either
        guard = None
    budget.charge(1)
    for arg in args:
        if type(arg) is not float:
            _measure(budget, arg)
    for arg in named.values():
        _measure(budget, arg)
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
    _measure(budget, owner)
    if isinstance(owner, str | bytes):
        guard = _TEXT_METHODS.get(name)
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


def _product(budget: Budget, function: Value, args: list[Value], named: dict[str, Value]) -> Value:
    if function is math.prod and args:
        args = [list(args[0]), *args[1:]]
    factors = args[0] if function is math.prod and args else args
    budget.bits(sum(n.bit_length() for n in factors if isinstance(n, int)))
    return function(*args, **named)


def _sum(budget: Budget, function: Value, args: list[Value], named: dict[str, Value]) -> Value:
    if args:
        items = list(args[0])
        lengths = sum(len(item) for item in items if isinstance(item, _SIZED))
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
    math.factorial: _factorial,
    math.comb: _combinations,
    math.perm: _combinations,
    math.prod: _product,
    math.lcm: _product,
}


def _format(budget: Budget, owner: str, args: list[Value], named: dict[str, Value]) -> str:
    import string

    class Formatter(string.Formatter):
        def get_field(self, field_name: str, args: Value, kwargs: Value) -> Value:
            first, _, _ = field_name.partition(".")
            first = first.partition("[")[0]
            value = self.get_value(int(first) if first.isdigit() else first, args, kwargs)
            for is_attribute, name in _field_path(field_name[len(first) :]):
                if is_attribute:
                    value = attribute(value, name)
                else:
                    value = value[int(name) if name.isdigit() else name]
            return value, first

        def format_field(self, value: Value, format_spec: str) -> str:
            return format_value(budget, value, format_spec)

    for value in (*args, *named.values()):
        budget.weigh(value)
    return Formatter().vformat(owner, args, named)


def _field_path(path: str) -> list[tuple[bool, str]]:
    parts = re.findall(r"\.([^.\[]+)|\[([^\]]+)\]", path)
    return [(bool(name), name or index) for name, index in parts]


def format_value(budget: Budget, value: Value, spec: str) -> str:
    """`format(value, spec)`."""
    _widths(budget, spec, ())
    budget.weigh(value)
    return budget.checked(format(value, spec))  # type: ignore[no-any-return]


def _padded(name: str) -> Callable[[Budget, Any, list[Value], dict[str, Value]], Any]:
    def padded(budget: Budget, owner: Value, args: list[Value], named: dict[str, Value]) -> Value:
        widths = [v for v in (*args, *named.values()) if isinstance(v, int)]
        width = max(map(abs, widths), default=8)
        budget.length(
            width * (owner.count("\t" if isinstance(owner, str) else b"\t") + 1)
            if name == "expandtabs"
            else width
        )
        return getattr(owner, name)(*args, **named)

    return padded


def _replace(budget: Budget, owner: Value, args: list[Value], named: dict[str, Value]) -> Value:
    if len(args) >= 2 and all(isinstance(a, str | bytes) for a in args[:2]):
        budget.length(len(owner) + (owner.count(args[0]) * len(args[1])))
    return owner.replace(*args, **named)


def _join(budget: Budget, owner: Value, args: list[Value], named: dict[str, Value]) -> Value:
    if len(args) == 1 and not isinstance(args[0], str | bytes):
        items = list(args[0])
        budget.charge(len(items))
        budget.length(sum(len(i) for i in items if isinstance(i, str | bytes)) + len(owner) * len(items))
        args = [items]
    return owner.join(*args, **named)


def _translate(budget: Budget, owner: Value, args: list[Value], named: dict[str, Value]) -> Value:
    if args and isinstance(args[0], dict):
        longest = max((len(v) for v in args[0].values() if isinstance(v, str)), default=1)
        budget.length(len(owner) * max(longest, 1))
    return owner.translate(*args, **named)


def _format_map(budget: Budget, owner: str, args: list[Value], named: dict[str, Value]) -> str:
    return _format(budget, owner, [], dict(args[0]))


_TEXT_METHODS: dict[str, Callable[[Budget, Any, list[Value], dict[str, Value]], Any]] = {
    "format": _format,
    "format_map": _format_map,
    "replace": _replace,
    "join": _join,
    "translate": _translate,
    **{name: _padded(name) for name in ("ljust", "rjust", "center", "zfill", "expandtabs")},
}
