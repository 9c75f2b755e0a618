"""Compiles Python's syntax trees to closures, without running Python code.

A closure takes an environment with `lookup(name)`, `assign(name, value)` and `budget`. Names, operators,
calls and attributes mean the same as in Python. Attributes give access only to public data
(`values.attribute`). Everything that could grow is measured first (`operators`, `functions`).
"""

from __future__ import annotations

import ast
from collections.abc import Callable

from kbot.xacro.expressions import comprehensions
from kbot.xacro.expressions.formatting import format_value
from kbot.xacro.expressions.functions import call
from kbot.xacro.expressions.operations import (
    Closure,
    InvalidExpression,
    comparison,
    function_closure,
    item,
    name_closure,
    negation,
    operation,
    refuse_private,
)
from kbot.xacro.expressions.operators import COMPARE
from kbot.xacro.values import Value, attribute, public_names

TYPE_CHECKING = False
if TYPE_CHECKING:
    from typing import Any

    from kbot.xacro.expressions.operations import Environment


def closure_of(node: ast.expr) -> Closure:
    """The closure of an expression's syntax tree.

    Raises:
        InvalidExpression: it contains something that is not allowed in an expression.
        XacroError: X191, it uses a forbidden name.
    """
    make = _MAKERS.get(type(node))
    if make is None:
        raise InvalidExpression(f"{type(node).__name__} is not allowed in an expression", node.col_offset)
    return make(node)


def _constant(node: ast.Constant) -> Closure:
    value = node.value
    return lambda env: value


def _binary(node: ast.BinOp) -> Closure:
    return operation(type(node.op).__name__, closure_of(node.left), closure_of(node.right))


def _unary(node: ast.UnaryOp) -> Closure:
    operand = closure_of(node.operand)
    match node.op:
        case ast.USub():
            return negation(operand)
        case ast.UAdd():
            return lambda env: env.budget.checked(+operand(env))
        case ast.Not():
            return lambda env: not operand(env)
    return lambda env: env.budget.checked(~operand(env))


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
        (COMPARE[type(op).__name__], closure_of(right))
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


def _conditional(node: ast.IfExp) -> Closure:
    test, body, other = closure_of(node.test), closure_of(node.body), closure_of(node.orelse)
    return lambda env: body(env) if test(env) else other(env)


def _attribute(node: ast.Attribute) -> Closure:
    value, name = closure_of(node.value), node.attr
    refuse_private(name)

    def get(env: Environment) -> Value:
        owner = value(env)
        try:
            return env.budget.checked(attribute(owner, name))
        except AttributeError as error:
            error.candidates = public_names(owner)  # type: ignore[attr-defined]  # for the hint of `templates.failed`
            error.wanted = name  # type: ignore[attr-defined]  # the same
            raise

    return get


def _subscript(node: ast.Subscript) -> Closure:
    value, index = closure_of(node.value), closure_of(node.slice)

    return lambda env: env.budget.checked(item(env.budget, value(env), index(env)))


def _slice(node: ast.Slice) -> Closure:
    parts = [closure_of(part) if part else None for part in (node.lower, node.upper, node.step)]
    return lambda env: slice(*[part(env) if part else None for part in parts])


def items(nodes: list[ast.expr]) -> Callable[[Environment], list[Value]]:
    """The function that computes the items of a list, also with `*`."""
    if not any(isinstance(node, ast.Starred) for node in nodes):
        closures = [closure_of(node) for node in nodes]
        return lambda env: [closure(env) for closure in closures]
    mixed = [
        (isinstance(node, ast.Starred), closure_of(node.value if isinstance(node, ast.Starred) else node))
        for node in nodes
    ]

    def spread(env: Environment) -> list[Value]:
        values: list[Value] = []
        for starred, closure in mixed:
            if starred:
                value = closure(env)
                env.budget.measure(value)
                env.budget.spread(value)
                values.extend(value)
                env.budget.checked(values)
            else:
                values.append(closure(env))
        return values

    return spread


def _list(node: ast.List) -> Closure:
    return items(node.elts)


def _tuple(node: ast.Tuple) -> Closure:
    make_items = items(node.elts)
    return lambda env: tuple(make_items(env))


_HASHED_STEPS = 4
"""Steps charged for a set or dictionary. The smallest one with an item takes about 230 bytes."""


def _set(node: ast.Set) -> Closure:
    make_items = items(node.elts)

    def make(env: Environment) -> Value:
        values = make_items(env)
        env.budget.charge(_HASHED_STEPS)
        env.budget.keys(0, values)
        return set(values)

    return make


def _dict(node: ast.Dict) -> Closure:
    pairs = [
        (closure_of(key) if key else None, closure_of(value))
        for key, value in zip(node.keys, node.values, strict=True)
    ]

    def make(env: Environment) -> Value:
        result: dict[Value, Value] = {}
        env.budget.charge(_HASHED_STEPS)
        for key, value in pairs:
            if key is None:
                more = value(env)
                env.budget.measure(more)
                env.budget.keys(len(result), more)
                result.update(more)
            else:
                new = key(env)
                env.budget.keys(len(result), (new,))
                result[new] = value(env)
        return env.budget.checked(result)

    return make


def _call(node: ast.Call) -> Closure:
    named_by = node.func.id if isinstance(node.func, ast.Name) else ""
    function, arguments = function_closure(named_by) if named_by else closure_of(node.func), items(node.args)
    named = [(keyword.arg, closure_of(keyword.value)) for keyword in node.keywords]
    if not named:
        return lambda env: call(env.budget, function(env), arguments(env), {})

    def with_keywords(env: Environment) -> Value:
        target, values = function(env), arguments(env)
        keywords: dict[str, Value] = {}
        for name, closure in named:
            if name is None:
                more = closure(env)
                env.budget.measure(more)
                keywords.update(more)
            else:
                keywords[name] = closure(env)
        return call(env.budget, target, values, keywords)

    return with_keywords


def _assignment(node: ast.NamedExpr) -> Closure:
    value, name = closure_of(node.value), node.target.id
    refuse_private(name)

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
        if convert:
            env.budget.weigh(result)
            result = convert(result)
        return format_value(env.budget, result, spec(env))

    return formatted


def _joined(node: ast.JoinedStr) -> Closure:
    parts = [closure_of(part) for part in node.values]
    return lambda env: env.budget.joined([part(env) for part in parts])


_MAKERS: dict[type[ast.expr], Callable[[Any], Closure]] = {  # Any: each takes its own kind of node
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
    ast.Lambda: comprehensions.lambda_closure,
    ast.ListComp: comprehensions.list_comprehension_closure,
    ast.SetComp: comprehensions.set_comprehension_closure,
    ast.GeneratorExp: comprehensions.generator_closure,
    ast.DictComp: comprehensions.dict_comprehension_closure,
    ast.NamedExpr: _assignment,
    ast.FormattedValue: _formatted,
    ast.JoinedStr: _joined,
}
