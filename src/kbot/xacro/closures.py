"""Python's syntax tree turned into closures, never into Python code.

A closure takes an environment, which has a `lookup(name)`, an `assign(name, value)` and a
`budget`. Names, operators, calls and attributes mean what they mean in Python; attributes lead
only to public data (`values.attribute`), and everything that could grow is measured first
(`bounds`).
"""

from __future__ import annotations

import ast
from collections.abc import Callable, Iterator

from kbot.xacro import bounds
from kbot.xacro.bounds import Budget
from kbot.xacro.faults import Fault
from kbot.xacro.values import Value, attribute, public_names

TYPE_CHECKING = False
if TYPE_CHECKING:
    from typing import Any, Protocol

    class Environment(Protocol):
        """Where names are looked up."""

        @property
        def budget(self) -> Budget: ...
        def lookup(self, name: str) -> Value: ...
        def assign(self, name: str, value: Value) -> None: ...


Closure = Callable[[Value], Value]


class InvalidExpression(Exception):
    """A syntax error; `column` (0-based) is where in the expression, where that is known."""

    def __init__(self, message: str, column: int | None = None) -> None:
        super().__init__(message)
        self.column = column


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


def closure_of(node: ast.expr) -> Closure:
    """The closure of an expression's syntax tree.

    Raises:
        InvalidExpression: it holds something that has no place in an expression.
        Fault: X191, it uses a name that is refused.
    """
    make = _MAKERS.get(type(node))
    if make is None:
        raise InvalidExpression(f"{type(node).__name__} has no place in an expression", node.col_offset)
    return make(node)


def _refuse(name: str) -> None:
    if name.startswith("__"):
        raise Fault(
            "X191", f"the name '{name}' is refused: names with two leading underscores are Python's own"
        )


def name_closure(identifier: str) -> Closure:
    """The closure of a name."""
    _refuse(identifier)
    return lambda env: env.lookup(identifier)


def _constant(node: ast.Constant) -> Closure:
    value = node.value
    return lambda env: value


def _binary(node: ast.BinOp) -> Closure:
    return operation(type(node.op).__name__, closure_of(node.left), closure_of(node.right))


def operation(kind: str, left: Closure, right: Closure) -> Closure:
    """The closure of a binary operator, by the name of its syntax tree's class."""
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
    operand = closure_of(node.operand)
    match node.op:
        case ast.USub():
            return lambda env: -operand(env)
        case ast.UAdd():
            return lambda env: +operand(env)
        case ast.Not():
            return lambda env: not operand(env)
    return lambda env: ~operand(env)


def _boolean(node: ast.BoolOp) -> Closure:
    operands = [closure_of(value) for value in node.values]
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
    first = closure_of(node.left)
    if len(node.ops) == 1:
        return comparison(type(node.ops[0]).__name__, first, closure_of(node.comparators[0]))
    steps = [
        (bounds.COMPARE[type(op).__name__], closure_of(right))
        for op, right in zip(node.ops, node.comparators, strict=True)
    ]

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


def comparison(kind: str, left: Closure, right: Closure) -> Closure:
    """The closure of a comparison, by the name of its syntax tree's class."""
    function = bounds.COMPARE[kind]
    return lambda env: function(env.budget, left(env), right(env))


def _conditional(node: ast.IfExp) -> Closure:
    test, body, other = closure_of(node.test), closure_of(node.body), closure_of(node.orelse)
    return lambda env: body(env) if test(env) else other(env)


def _attribute(node: ast.Attribute) -> Closure:
    value, name = closure_of(node.value), node.attr
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
    value, index = closure_of(node.value), closure_of(node.slice)

    return lambda env: env.budget.checked(item(value(env), index(env)))


def item(owner: Value, index: Value) -> Value:
    """`owner[index]`."""
    if isinstance(owner, type):
        raise TypeError(f"type '{owner.__name__}' is not subscriptable here")
    return owner[index]


def _slice(node: ast.Slice) -> Closure:
    parts = [closure_of(part) if part else None for part in (node.lower, node.upper, node.step)]
    return lambda env: slice(*[part(env) if part else None for part in parts])


def _items(nodes: list[ast.expr]) -> Callable[[Environment], list[Value]]:
    if not any(isinstance(node, ast.Starred) for node in nodes):
        closures = [closure_of(node) for node in nodes]
        return lambda env: [closure(env) for closure in closures]
    mixed = [
        (isinstance(node, ast.Starred), closure_of(node.value if isinstance(node, ast.Starred) else node))
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
        (closure_of(key) if key else None, closure_of(value))
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
    function, arguments = closure_of(node.func), _items(node.args)
    named = [(keyword.arg, closure_of(keyword.value)) for keyword in node.keywords]
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
    arguments, body = node.args, closure_of(node.body)
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
        tests = [closure_of(test) for test in generator.ifs]
        parts.append((closure_of(generator.iter), _target(generator.target), tests))

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
    loops, element = _loops(node.generators), closure_of(node.elt)
    return lambda env: env.budget.checked([element(frame) for frame in loops(env)])


def _set_comprehension(node: ast.SetComp) -> Closure:
    loops, element = _loops(node.generators), closure_of(node.elt)
    return lambda env: env.budget.checked({element(frame) for frame in loops(env)})


def _generator(node: ast.GeneratorExp) -> Closure:
    loops, element = _loops(node.generators), closure_of(node.elt)
    return lambda env: (element(frame) for frame in loops(env))


def _dict_comprehension(node: ast.DictComp) -> Closure:
    loops, key, value = _loops(node.generators), closure_of(node.key), closure_of(node.value)
    return lambda env: env.budget.checked({key(frame): value(frame) for frame in loops(env)})


def _assignment(node: ast.NamedExpr) -> Closure:
    value, name = closure_of(node.value), node.target.id
    _refuse(name)

    def assign(env: Environment) -> Value:
        result = value(env)
        env.assign(name, result)
        return result

    return assign


_CONVERSIONS: dict[int, Callable[[Value], str]] = {ord("s"): str, ord("r"): repr, ord("a"): ascii}


def _formatted(node: ast.FormattedValue) -> Closure:
    value = closure_of(node.value)
    spec = closure_of(node.format_spec) if node.format_spec else (lambda env: "")
    convert = _CONVERSIONS.get(node.conversion)

    def formatted(env: Environment) -> str:
        result = value(env)
        env.budget.weigh(result)
        return bounds.format_value(env.budget, convert(result) if convert else result, spec(env))

    return formatted


def _joined(node: ast.JoinedStr) -> Closure:
    parts = [closure_of(part) for part in node.values]
    return lambda env: env.budget.checked("".join([part(env) for part in parts]))


_MAKERS: dict[type[ast.expr], Callable[[Any], Closure]] = {
    ast.Name: lambda node: name_closure(node.id),
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
