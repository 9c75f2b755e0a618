"""The costs of calls in expressions: one table for functions and one for methods.

A cost charges the work of a call before the call. It may replace arguments, and it may return another
function to call instead. `functions.call` looks it up for every call, also for calls by `map`, `sorted` or
`min`.
"""

from __future__ import annotations

import math
from collections.abc import Callable

from kbot.xacro.budget import HASHED, SIZED, Budget
from kbot.xacro.expressions.formatting import format_text
from kbot.xacro.expressions.iterators import Counted
from kbot.xacro.names import has_attribute, tokenize
from kbot.xacro.values import Value, YamlDict
from kbot.xacro.xacro_error import XacroError

TYPE_CHECKING = False
if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator
    from typing import Any

Cost = Callable[["Budget", "Value", "list[Value]", "dict[str, Value]"], "Callable[..., Value] | None"]
"""Parameters: the budget, the object whose method is called, the arguments, the named arguments."""


def _values(args: list[Value], named: dict[str, Value]) -> Iterable[Value]:
    return (*args, *named.values()) if named else args


def _items(value: Value) -> Iterable[Value]:
    """The items of a container, or nothing for other values."""
    return value if isinstance(value, SIZED) else ()


def _listed(args: list[Value]) -> None:
    """Replace iterators by lists of their items, which can be measured before the call."""
    for index, arg in enumerate(args):
        if isinstance(arg, Counted):
            args[index] = list(arg)


# --- any type --------------------------------------------------------------------------------


def filled(budget: Budget, owner: Value, args: list[Value], named: dict[str, Value]) -> None:
    """The function puts all items of its arguments into a list or tuple."""
    measured(budget, owner, args, named)
    for arg in args:
        budget.spread(arg)


def free(budget: Budget, owner: Value, args: list[Value], named: dict[str, Value]) -> None:
    """The function takes constant time."""


def measured(budget: Budget, owner: Value, args: list[Value], named: dict[str, Value]) -> None:
    """The function goes through its arguments once."""
    budget.measure(owner)
    for value in _values(args, named):
        budget.measure(value)


def weighed(budget: Budget, owner: Value, args: list[Value], named: dict[str, Value]) -> None:
    """The function goes through its arguments and all nested values: it compares, hashes or writes them."""
    _listed(args)
    budget.weigh(owner)
    for value in _values(args, named):
        budget.weigh(value)


def _refused(budget: Budget, owner: Value, args: list[Value], named: dict[str, Value]) -> None:
    raise XacroError("X191", "this function is not allowed: it gives access to Python's internals")


def _type(budget: Budget, owner: Value, args: list[Value], named: dict[str, Value]) -> None:
    if len(args) != 1 or named:
        raise XacroError("X191", "type() cannot create types here", "pass one argument")


# --- functions that take or return iterators --------------------------------------------------


def guarded(budget: Budget, function: Value) -> Value:
    """A function that charges its costs when Python's C code calls it."""
    if not callable(function):
        return function
    from kbot.xacro.expressions.functions import call  # cycle: it imports this module

    return lambda *args, **named: call(budget, function, list(args), named)


def _iterator(function: Callable[..., Iterator[Value]]) -> Cost:
    """The function returns an iterator: each item is charged when it is read."""
    calls_back = function in (map, filter)

    def cost(
        budget: Budget, owner: Value, args: list[Value], named: dict[str, Value]
    ) -> Callable[..., Value]:
        measured(budget, owner, args, named)
        if calls_back and args:
            args[0] = guarded(budget, args[0])
        return lambda *args, **named: Counted(budget, function(*args, **named))

    return cost


_LONG: tuple[Any, ...] = (str, *SIZED)  # Any: mypy would narrow values to object


def _ordered(budget: Budget, owner: Value, args: list[Value], named: dict[str, Value]) -> None:
    """`sorted`, `min`, `max`, `list.sort`: each item takes about log2(n) comparisons."""
    _listed(args)
    longest = max((len(value) for value in (owner, *args) if isinstance(value, _LONG)), default=0)
    more = longest.bit_length() >> 3

    def weigh(value: Value) -> None:
        before = budget.steps
        budget.weigh(value)
        if more:
            budget.charge((before - budget.steps) * more)

    if callable(named.get("key")):
        key = guarded(budget, named["key"])

        def weighed_key(item: Value) -> Value:
            result = key(item)
            weigh(result)
            return result

        named["key"] = weighed_key
    for value in (owner, *args):
        budget.spread(value)
        weigh(value)


def _sum(budget: Budget, owner: Value, args: list[Value], named: dict[str, Value]) -> None:
    """For lists and tuples, each intermediate sum is a copy of the previous one."""
    _listed(args)
    measured(budget, owner, args, named)
    parts = [*args[1:], *named.values(), *(_items(args[0]) if args else ())]
    length = sum(len(part) for part in parts if isinstance(part, SIZED))
    budget.length(length)
    budget.charge(len(parts) * (length >> 3))
    for part in parts:
        if isinstance(part, int):
            budget.integer(part)


# --- whole numbers ----------------------------------------------------------------------------


def _range(budget: Budget, owner: Value, args: list[Value], named: dict[str, Value]) -> None:
    result = range(*args, **named)
    try:
        size = len(result)
    except OverflowError:
        size = budget.limits.steps + 1
    budget.charge(size)


def _factorial(budget: Budget, owner: Value, args: list[Value], named: dict[str, Value]) -> None:
    for n in args:
        if isinstance(n, int) and n > 1:
            budget.bits(n * math.log2(n))
            budget.charge(n >> 2)


def _combinations(is_ordered: bool) -> Cost:
    """`math.perm` and `math.comb`: a product with one factor for each chosen (or not chosen) item."""

    def cost(budget: Budget, owner: Value, args: list[Value], named: dict[str, Value]) -> None:
        if args and all(isinstance(n, int) for n in args):
            n, chosen = args[0], args[-1]
            factors = max(chosen if is_ordered else min(chosen, n - chosen), 0)
            budget.bits(factors * n.bit_length())
            budget.charge(factors)

    return cost


def _round(budget: Budget, owner: Value, args: list[Value], named: dict[str, Value]) -> None:
    measured(budget, owner, args, named)
    for digits in (*args[1:], *named.values()):
        if isinstance(digits, int):  # rounding an integer computes a power of ten
            budget.bits(-digits * math.log2(10))


def _product(budget: Budget, owner: Value, args: list[Value], named: dict[str, Value]) -> None:
    _listed(args)
    measured(budget, owner, args, named)
    factors = [*named.values()]
    for arg in args:
        factors += _items(arg) if isinstance(arg, SIZED) else [arg]
    bits = sum(n.bit_length() for n in factors if isinstance(n, int))
    budget.bits(bits)
    budget.charge(len(factors) * (1 + (bits >> 10)))


def _to_bytes(budget: Budget, owner: Value, args: list[Value], named: dict[str, Value]) -> None:
    budget.length(max((n for n in _values(args, named) if isinstance(n, int)), default=1))


# --- text -------------------------------------------------------------------------------------


def _needles(args: list[Value], named: dict[str, Value]) -> int:
    """The total length of the texts to search for."""
    size = 0
    for arg in _values(args, named):
        if isinstance(arg, str | bytes):
            size += len(arg)
        elif isinstance(arg, tuple):
            size += len(arg) + sum(len(item) for item in arg if isinstance(item, str | bytes))
    return size


def search(budget: Budget, owner: Value, args: list[Value], named: dict[str, Value]) -> None:
    """The method searches for a text in another. At worst, it compares each character with each."""
    size = len(owner)
    budget.charge((size * _needles(args, named) >> 10) + (size >> 4))


def _starts(budget: Budget, owner: Value, args: list[Value], named: dict[str, Value]) -> None:
    for arg in args[:1]:
        for part in arg if isinstance(arg, tuple) else (arg,):
            size = min(len(part), len(owner)) if isinstance(part, str | bytes) else 0
            budget.charge(1 + (size >> 6))


def _split(budget: Budget, owner: Value, args: list[Value], named: dict[str, Value]) -> None:
    """A search that creates a text of about 60 bytes for each piece."""
    search(budget, owner, args, named)
    separators = [len(a) for a in _values(args, named) if isinstance(a, str | bytes) and a]
    budget.charge(len(owner) // (separators[0] if separators else 2))


def _replace(budget: Budget, owner: Value, args: list[Value], named: dict[str, Value]) -> None:
    search(budget, owner, args, named)
    if len(args) >= 2 and all(isinstance(a, str | bytes) for a in args[:2]):
        result = len(owner) + owner.count(args[0]) * len(args[1])
        budget.length(result)
        budget.charge(result >> 4)


def _join(budget: Budget, owner: Value, args: list[Value], named: dict[str, Value]) -> None:
    _listed(args)
    measured(budget, owner, args, named)
    if len(args) == 1 and isinstance(args[0], SIZED):
        total = sum(len(i) for i in args[0] if isinstance(i, str | bytes)) + len(owner) * len(args[0])
        budget.length(total)
        budget.charge(total >> 4)


def _translate(budget: Budget, owner: Value, args: list[Value], named: dict[str, Value]) -> None:
    """Each character is looked up in a table and replaced by a text of any length."""
    measured(budget, owner, args, named)
    if not args or not isinstance(owner, str):
        return
    table = args[0]
    entries = dict.values(table) if isinstance(table, dict) else _items(table)
    longest = max((len(entry) for entry in entries if isinstance(entry, str)), default=1)
    budget.length(len(owner) * max(longest, 1))
    budget.charge(len(owner) * (1 + (len(table) >> 5 if isinstance(table, SIZED) else 0)))


def _make_table(budget: Budget, owner: Value, args: list[Value], named: dict[str, Value]) -> None:
    """`maketrans` creates an entry for each character."""
    for arg in args:
        if isinstance(arg, str | bytes):
            budget.charge(len(arg))
    _dict(budget, None, [arg for arg in args if isinstance(arg, dict)], named)


def _padded(budget: Budget, owner: Value, args: list[Value], named: dict[str, Value]) -> None:
    """The method pads a text to a width."""
    measured(budget, owner, args, named)
    budget.length(max((abs(v) for v in _values(args, named) if isinstance(v, int)), default=8))


def _tabs(budget: Budget, owner: Value, args: list[Value], named: dict[str, Value]) -> None:
    measured(budget, owner, args, named)
    width = max((abs(v) for v in _values(args, named) if isinstance(v, int)), default=8)
    budget.length(len(owner) + width * owner.count("\t" if isinstance(owner, str) else b"\t"))


_PYTHON_CODECS = ("punycode", "idna")


def _codec(budget: Budget, owner: Value, args: list[Value], named: dict[str, Value]) -> None:
    """Encode or decode. The time of some codecs grows with the square of the length. Some error handlers
    write a name of up to 88 characters for each character."""
    size = max((len(v) for v in (owner, *_values(args, named)) if isinstance(v, str | bytes)), default=0)
    budget.measure(owner)
    names = [str(v) for v in _values(args, named) if isinstance(v, str)]
    if any(word in name.lower() for name in names for word in _PYTHON_CODECS):
        budget.charge(size * size)
    if len(names) > 1 or "errors" in named:
        budget.length(size * 88)
        budget.charge(size * 4)
    budget.charge(size >> 2)


def _str(budget: Budget, owner: Value, args: list[Value], named: dict[str, Value]) -> None:
    if len(args) > 1 or named:
        _codec(budget, args[0] if args else "", args[1:], named)
    for arg in args:
        if type(arg) is not str:
            budget.weigh(arg)


def _bytes(budget: Budget, owner: Value, args: list[Value], named: dict[str, Value]) -> None:
    """`bytes(n)` creates n zeros."""
    measured(budget, owner, args, named)
    for arg in args:
        if isinstance(arg, int):
            budget.length(arg)
            budget.charge(arg >> 4)
    _str(budget, owner, args, named)


def _format(budget: Budget, owner: Value, args: list[Value], named: dict[str, Value]) -> Callable[..., Value]:
    return lambda *args, **named: format_text(budget, owner, args, named)


def _format_map(
    budget: Budget, owner: Value, args: list[Value], named: dict[str, Value]
) -> Callable[..., Value]:
    return lambda table: format_text(budget, owner, [], dict(table))


def _tokenize(budget: Budget, owner: Value, args: list[Value], named: dict[str, Value]) -> None:
    """`xacro.tokenize` compares each character with each separator, and may split at each."""
    sizes = [len(a) for a in _values(args, named) if isinstance(a, str)]
    if sizes:
        budget.charge((math.prod(sizes) >> 8) + sizes[0])
    for value in _values(args, named):
        budget.weigh(value)


# --- containers -------------------------------------------------------------------------------


def _mutated(budget: Budget, owner: Value, args: list[Value], named: dict[str, Value]) -> None:
    """`list.insert` and `list.pop` move all following items."""
    budget.charge(len(owner) >> 6)


def _key(budget: Budget, owner: Value, args: list[Value], named: dict[str, Value]) -> None:
    """The method of a dictionary or set finds or inserts one key."""
    if args:
        budget.keys(len(owner), args[:1])


def _keyed(budget: Budget, owner: Value, args: list[Value], named: dict[str, Value]) -> None:
    """The method of a set finds or inserts the items of its arguments, or its own items in the arguments."""
    _listed(args)
    measured(budget, owner, args, named)
    for arg in args:
        budget.keys(len(owner), _items(arg))
        if isinstance(arg, HASHED):
            budget.keys(len(arg), owner)


def _set(budget: Budget, owner: Value, args: list[Value], named: dict[str, Value]) -> None:
    _listed(args)
    measured(budget, owner, args, named)
    for arg in args[:1]:
        budget.keys(0, _items(arg))


def _dict(budget: Budget, owner: Value, args: list[Value], named: dict[str, Value]) -> None:
    """Create or extend a dictionary from another one, or from pairs."""
    _listed(args)
    measured(budget, owner, args, named)
    size = len(owner) if isinstance(owner, dict) else 0
    for index, arg in enumerate(args):
        if isinstance(arg, dict):
            budget.keys(size, arg)
        elif isinstance(arg, SIZED):
            args[index] = pairs = [tuple(pair) if isinstance(pair, Counted) else pair for pair in arg]
            budget.keys(size, [next(iter(pair), None) for pair in pairs if isinstance(pair, SIZED)])
            for pair in pairs:
                budget.measure(pair)


def _removed(budget: Budget, owner: Value, args: list[Value], named: dict[str, Value]) -> None:
    """`popitem` and `set.pop` search for a remaining entry."""
    budget.charge(len(owner) >> 6)


# --- the tables -------------------------------------------------------------------------------


def _each(cost: Cost, *names: str) -> dict[str, Cost]:
    return dict.fromkeys(names, cost)


FUNCTIONS: dict[Any, Cost] = {
    **dict.fromkeys((len, bool, slice), free),
    **dict.fromkeys((abs, all, any, complex, divmod, float, int, ord), measured),
    **dict.fromkeys((list, tuple), filled),
    **dict.fromkeys((hash, has_attribute, isinstance, issubclass, repr), weighed),
    **{function: _iterator(function) for function in (map, filter, zip, enumerate, reversed)},
    **dict.fromkeys((sorted, min, max), _ordered),
    **dict.fromkeys((set, frozenset), _set),
    dict: _dict,
    YamlDict: _dict,
    str: _str,
    bytes: _bytes,
    sum: _sum,
    range: _range,
    round: _round,
    type: _type,
    vars: _refused,
    tokenize: _tokenize,
    **dict.fromkeys([f for f in vars(math).values() if callable(f) and not isinstance(f, type)], measured),
    **dict.fromkeys((str.maketrans, bytes.maketrans), _make_table),  # static methods have no owner object
    math.factorial: _factorial,
    math.comb: _combinations(is_ordered=False),
    math.perm: _combinations(is_ordered=True),
    math.prod: _product,
    math.lcm: _product,
}
"""Functions and types that an expression can call, besides those that KBot defines."""

_TEXT: dict[str, Cost] = {
    **_each(search, "count", "find", "rfind", "index", "rindex", "partition", "rpartition"),
    **_each(search, "strip", "lstrip", "rstrip"),
    **_each(_split, "split", "rsplit", "splitlines"),
    **_each(_starts, "startswith", "endswith"),
    **_each(_padded, "ljust", "rjust", "center", "zfill"),
    **_each(_codec, "encode", "decode"),
    "expandtabs": _tabs,
    "replace": _replace,
    "join": _join,
    "translate": _translate,
}
_SET = {
    **_each(_key, "add", "discard", "remove"),
    **_each(_keyed, "difference", "difference_update", "intersection", "intersection_update", "isdisjoint"),
    **_each(_keyed, "issubset", "issuperset", "symmetric_difference", "symmetric_difference_update"),
    **_each(_keyed, "union", "update"),
    "pop": _removed,
}
METHODS: dict[type, dict[str, Cost]] = {
    str: _TEXT | {"format": _format, "format_map": _format_map},
    bytes: _TEXT,
    int: {"to_bytes": _to_bytes},
    float: {},
    complex: {},
    list: {
        **_each(weighed, "count", "index", "remove"),
        **_each(_mutated, "insert", "pop"),
        "append": free,
        "extend": filled,
        "sort": _ordered,
    },
    tuple: _each(weighed, "count", "index"),
    dict: {
        **_each(_key, "get", "pop", "setdefault"),
        **_each(free, "items", "keys", "values"),
        "popitem": _removed,
        "update": _dict,
        "fromkeys": _set,
    },
    set: _SET,
    frozenset: _SET,
    range: _each(weighed, "count", "index"),
    slice: {},
}
"""Costs of methods by type. A method that is not listed here has the cost `measured`."""
