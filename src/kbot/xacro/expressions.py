"""Expressions of `${…}`: Python's syntax tree, turned once into closures, never into Python code.

A closure takes an environment, which has a `lookup(name)`, an `assign(name, value)` and a
`budget`. Names, operators, calls and attributes mean what they mean in Python; attributes lead
only to public data (`values.attribute`), and everything that could grow is measured first
(`bounds`).
"""

from __future__ import annotations

import ast
import re
import warnings
from collections.abc import Callable, Iterator
from typing import Any, Protocol

from kbot.xacro import bounds
from kbot.xacro.bounds import Budget
from kbot.xacro.faults import Fault
from kbot.xacro.values import Value, attribute, public_names

MAX_CHARACTERS = 20_000


class Environment(Protocol):
    """Where names are looked up."""

    @property
    def budget(self) -> Budget: ...
    def lookup(self, name: str) -> Value: ...
    def assign(self, name: str, value: Value) -> None: ...


Closure = Callable[[Any], Value]


class InvalidExpression(Exception):
    """A syntax error; `column` (0-based) is where in the expression, where that is known."""

    def __init__(self, message: str, column: int | None = None) -> None:
        super().__init__(message)
        self.column = column


_NAME = re.compile(r"[A-Za-z_][A-Za-z0-9_]*\Z")
_KEYWORDS = frozenset(
    "False None True and as assert async await break class continue def del elif else except finally "
    "for from global if import in is lambda nonlocal not or pass raise return try while with yield".split()
)
_MAY_WARN = re.compile(r"\\|[0-9][A-Za-z]")
_cache: dict[str, Closure] = {}
_CACHE_SIZE = 20_000


def clear_cache() -> None:
    """Forget compiled expressions."""
    _cache.clear()


def compiled(expression: str) -> Closure:
    """The closure of an expression.

    Raises:
        InvalidExpression: it is not one.
        Fault: X191, it uses a name that is refused.
    """
    closure = _cache.get(expression)
    if closure is None:
        if len(_cache) >= _CACHE_SIZE:
            _cache.clear()
        closure = _cache[expression] = _compile(expression)
    return closure


def is_identifier(name: str) -> bool:
    """Whether a name can stand in an expression."""
    if _NAME.match(name):
        return name not in _KEYWORDS
    return name.isidentifier() and not name.isascii()


def _compile(expression: str) -> Closure:
    source = expression.strip()
    if _NAME.match(source) and source not in _KEYWORDS:
        return _name(source)
    if len(source) > MAX_CHARACTERS:
        raise InvalidExpression(f"the expression is longer than {MAX_CHARACTERS:,} characters")
    try:
        if _MAY_WARN.search(source):
            with warnings.catch_warnings():
                warnings.simplefilter("ignore")
                tree = ast.parse(source, "<expression>", "eval")
        else:
            tree = ast.parse(source, "<expression>", "eval")
    except SyntaxError as error:
        column = error.offset - 1 if error.offset and error.lineno == 1 else None
        raise InvalidExpression(error.msg if source else "the expression is empty", column) from None
    except (ValueError, MemoryError, RecursionError) as error:
        raise InvalidExpression(str(error) or "the expression is nested too deeply") from None
    try:
        return _closure(tree.body)
    except RecursionError:
        raise InvalidExpression("the expression is nested too deeply") from None


class Frame:
    """The variables of a comprehension or of a lambda function, before those around it."""

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


def _closure(node: ast.expr) -> Closure:
    make = _MAKERS.get(type(node))
    if make is None:
        raise InvalidExpression(f"{type(node).__name__} has no place in an expression", node.col_offset)
    return make(node)


def _refuse(name: str) -> None:
    if name.startswith("__"):
        raise Fault("X191", f"the name '{name}' is refused: names with two leading underscores are Python's own")


def _name(name: str) -> Closure:
    _refuse(name)
    return lambda env: env.lookup(name)


def _constant(node: ast.Constant) -> Closure:
    value = node.value
    return lambda env: value


def _binary(node: ast.BinOp) -> Closure:
    left, right = _closure(node.left), _closure(node.right)
    kind = type(node.op).__name__
    if kind == "Div":
        return lambda env: left(env) / right(env)
    function = bounds.BINARY[kind]
    if kind in ("Sub", "Add", "Mult"):
        direct = {"Sub": float.__sub__, "Add": float.__add__, "Mult": float.__mul__}[kind]

        def arithmetic(env: Environment) -> Value:
            a, b = left(env), right(env)
            if type(a) is float and type(b) is float:
                return direct(a, b)
            return function(env.budget, a, b)

        return arithmetic
    return lambda env: function(env.budget, left(env), right(env))


def _unary(node: ast.UnaryOp) -> Closure:
    operand = _closure(node.operand)
    match node.op:
        case ast.USub():
            return lambda env: -operand(env)
        case ast.UAdd():
            return lambda env: +operand(env)
        case ast.Not():
            return lambda env: not operand(env)
    return lambda env: ~operand(env)


def _boolean(node: ast.BoolOp) -> Closure:
    operands = [_closure(value) for value in node.values]
    last = operands.pop()
    stop_at = isinstance(node.op, ast.Or)

    def boolean(env: Environment) -> Value:
        for operand in operands:
            value = operand(env)
            if bool(value) is stop_at:
                return value
        return last(env)

    return boolean


def _compare(node: ast.Compare) -> Closure:
    first = _closure(node.left)
    steps = [
        (bounds.COMPARE[type(op).__name__], _closure(right))
        for op, right in zip(node.ops, node.comparators, strict=True)
    ]
    if len(steps) == 1:
        function, second = steps[0]
        return lambda env: function(env.budget, first(env), second(env))

    def chain(env: Environment) -> Value:
        left = first(env)
        result: Value = True
        for function, operand in steps:
            right = operand(env)
            result = function(env.budget, left, right)
            if not result:
                return result
            left = right
        return result

    return chain


def _conditional(node: ast.IfExp) -> Closure:
    test, body, other = _closure(node.test), _closure(node.body), _closure(node.orelse)
    return lambda env: body(env) if test(env) else other(env)


def _attribute(node: ast.Attribute) -> Closure:
    value, name = _closure(node.value), node.attr
    _refuse(name)

    def get(env: Environment) -> Value:
        owner = value(env)
        try:
            return attribute(owner, name)
        except AttributeError as error:
            error.candidates = public_names(owner)  # type: ignore[attr-defined]
            error.wanted = name  # type: ignore[attr-defined]
            raise

    return get


def _subscript(node: ast.Subscript) -> Closure:
    value, index = _closure(node.value), _closure(node.slice)

    def item(env: Environment) -> Value:
        owner = value(env)
        if isinstance(owner, type):
            raise TypeError(f"type '{owner.__name__}' is not subscriptable here")
        return env.budget.checked(owner[index(env)])

    return item


def _slice(node: ast.Slice) -> Closure:
    parts = [_closure(part) if part else None for part in (node.lower, node.upper, node.step)]
    return lambda env: slice(*[part(env) if part else None for part in parts])


def _items(nodes: list[ast.expr]) -> Callable[[Environment], list[Value]]:
    if not any(isinstance(node, ast.Starred) for node in nodes):
        closures = [_closure(node) for node in nodes]
        return lambda env: [closure(env) for closure in closures]
    mixed = [
        (isinstance(node, ast.Starred), _closure(node.value if isinstance(node, ast.Starred) else node))
        for node in nodes
    ]

    def items(env: Environment) -> list[Value]:
        values: list[Value] = []
        for starred, closure in mixed:
            if starred:
                values.extend(closure(env))
                env.budget.checked(values)
            else:
                values.append(closure(env))
        return values

    return items


def _list(node: ast.List) -> Closure:
    return _items(node.elts)


def _tuple(node: ast.Tuple) -> Closure:
    items = _items(node.elts)
    return lambda env: tuple(items(env))


def _set(node: ast.Set) -> Closure:
    items = _items(node.elts)
    return lambda env: set(items(env))


def _dict(node: ast.Dict) -> Closure:
    pairs = [
        (_closure(key) if key else None, _closure(value))
        for key, value in zip(node.keys, node.values, strict=True)
    ]

    def make(env: Environment) -> Value:
        result: dict[Value, Value] = {}
        for key, value in pairs:
            if key is None:
                result.update(value(env))
            else:
                result[key(env)] = value(env)
        return result

    return make


def _call(node: ast.Call) -> Closure:
    function, arguments = _closure(node.func), _items(node.args)
    named = [(keyword.arg, _closure(keyword.value)) for keyword in node.keywords]
    if not named:
        return lambda env: bounds.call(env.budget, function(env), arguments(env), {})

    def call(env: Environment) -> Value:
        target, values = function(env), arguments(env)
        keywords: dict[str, Value] = {}
        for name, closure in named:
            if name is None:
                keywords.update(closure(env))
            else:
                keywords[name] = closure(env)
        return bounds.call(env.budget, target, values, keywords)

    return call


def _lambda(node: ast.Lambda) -> Closure:
    arguments, body = node.args, _closure(node.body)
    positional = [a.arg for a in (*arguments.posonlyargs, *arguments.args)]
    defaults = _items(arguments.defaults)
    rest = arguments.vararg.arg if arguments.vararg else None
    if arguments.kwonlyargs or arguments.kwarg:
        raise InvalidExpression("a lambda function takes plain parameters here", node.col_offset)

    def make(env: Environment) -> Value:
        given = defaults(env)

        def function(*values: Value, **named: Value) -> Value:
            variables = dict(zip(positional[len(positional) - len(given) :], given, strict=True))
            variables.update(zip(positional, values, strict=False))
            if rest is not None:
                variables[rest] = tuple(values[len(positional) :])
            elif len(values) > len(positional):
                raise TypeError(f"the function takes {len(positional)} arguments, {len(values)} were given")
            for name, value in named.items():
                if name not in positional[len(values) :]:
                    raise TypeError(f"the function got an unexpected argument '{name}'")
                variables[name] = value
            missing = [name for name in positional if name not in variables]
            if missing:
                raise TypeError(f"the function misses the argument '{missing[0]}'")
            budget = env.budget
            budget.charge(1)
            budget.function_depth -= 1
            if budget.function_depth < 0:
                raise budget.exceeded("function_depth", "lambda functions call one another too deeply")
            try:
                return body(Frame(env, variables))
            finally:
                budget.function_depth += 1

        return function

    return make


Binder = Callable[[dict[str, Value], Value], None]


def _target(node: ast.expr) -> Binder:
    """What puts an item of a loop into its variables."""
    if isinstance(node, ast.Name):
        name = node.id

        def one(variables: dict[str, Value], value: Value) -> None:
            variables[name] = value

        return one
    if not isinstance(node, ast.Tuple | ast.List) or any(isinstance(n, ast.Starred) for n in node.elts):
        raise InvalidExpression("a loop's variable is a name or some names here", node.col_offset)
    binders = [_target(element) for element in node.elts]

    def several(variables: dict[str, Value], value: Value) -> None:
        values = list(value)
        if len(values) != len(binders):
            raise ValueError(f"{len(values)} values to unpack into {len(binders)} names")
        for binder, item in zip(binders, values, strict=True):
            binder(variables, item)

    return several


def _loops(generators: list[ast.comprehension]) -> Callable[[Environment], Iterator[Frame]]:
    """An iterator over the frames of a comprehension's innermost loop."""
    parts = []
    for generator in generators:
        if generator.is_async:
            raise InvalidExpression("async has no place in an expression")
        tests = [_closure(test) for test in generator.ifs]
        parts.append((_closure(generator.iter), _target(generator.target), tests))

    def run(env: Environment, frame: Frame, level: int) -> Iterator[Frame]:
        items, bind, tests = parts[level]
        budget = frame.budget
        for item in items(env):
            budget.charge(1)
            bind(frame.variables, item)
            if all(test(frame) for test in tests):
                if level + 1 < len(parts):
                    yield from run(frame, frame, level + 1)
                else:
                    yield frame

    return lambda env: run(env, Frame(env, {}), 0)


def _list_comprehension(node: ast.ListComp) -> Closure:
    loops, element = _loops(node.generators), _closure(node.elt)
    return lambda env: env.budget.checked([element(frame) for frame in loops(env)])


def _set_comprehension(node: ast.SetComp) -> Closure:
    loops, element = _loops(node.generators), _closure(node.elt)
    return lambda env: env.budget.checked({element(frame) for frame in loops(env)})


def _generator(node: ast.GeneratorExp) -> Closure:
    loops, element = _loops(node.generators), _closure(node.elt)
    return lambda env: (element(frame) for frame in loops(env))


def _dict_comprehension(node: ast.DictComp) -> Closure:
    loops, key, value = _loops(node.generators), _closure(node.key), _closure(node.value)
    return lambda env: env.budget.checked({key(frame): value(frame) for frame in loops(env)})


def _assignment(node: ast.NamedExpr) -> Closure:
    value, name = _closure(node.value), node.target.id
    _refuse(name)

    def assign(env: Environment) -> Value:
        result = value(env)
        env.assign(name, result)
        return result

    return assign


_CONVERSIONS: dict[int, Callable[[Value], str]] = {ord("s"): str, ord("r"): repr, ord("a"): ascii}


def _formatted(node: ast.FormattedValue) -> Closure:
    value = _closure(node.value)
    spec = _closure(node.format_spec) if node.format_spec else (lambda env: "")
    convert = _CONVERSIONS.get(node.conversion)

    def formatted(env: Environment) -> str:
        result = value(env)
        env.budget.weigh(result)
        return bounds.format_value(env.budget, convert(result) if convert else result, spec(env))

    return formatted


def _joined(node: ast.JoinedStr) -> Closure:
    parts = [_closure(part) for part in node.values]
    return lambda env: env.budget.checked("".join([part(env) for part in parts]))


_MAKERS: dict[type[ast.expr], Callable[[Any], Closure]] = {
    ast.Name: lambda node: _name(node.id),
    ast.Constant: _constant,
    ast.BinOp: _binary,
    ast.UnaryOp: _unary,
    ast.BoolOp: _boolean,
    ast.Compare: _compare,
    ast.IfExp: _conditional,
    ast.Attribute: _attribute,
    ast.Subscript: _subscript,
    ast.Slice: _slice,
    ast.List: _list,
    ast.Tuple: _tuple,
    ast.Set: _set,
    ast.Dict: _dict,
    ast.Call: _call,
    ast.Lambda: _lambda,
    ast.ListComp: _list_comprehension,
    ast.SetComp: _set_comprehension,
    ast.GeneratorExp: _generator,
    ast.DictComp: _dict_comprehension,
    ast.NamedExpr: _assignment,
    ast.FormattedValue: _formatted,
    ast.JoinedStr: _joined,
}
