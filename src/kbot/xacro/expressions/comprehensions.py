"""Compiles lambda functions and comprehensions: closures with local variables."""

from __future__ import annotations

import ast
from collections.abc import Callable

from kbot.xacro.expressions.iterators import Counted
from kbot.xacro.expressions.operations import CallFrame, Closure, InvalidExpression
from kbot.xacro.values import Value, YamlList

TYPE_CHECKING = False
if TYPE_CHECKING:
    from collections.abc import Iterator

    from kbot.xacro.expressions.operations import Environment


_FUNCTION_STEPS = 3
"""Steps charged for creating a function, which takes about 200 bytes."""


def _closure(node: ast.expr) -> Closure:
    from kbot.xacro.expressions.closures import closure_of  # cycle: it imports this module

    return closure_of(node)


def steps_of(*nodes: ast.expr) -> int:
    """The steps charged for evaluating parts of an expression, by their length.

    An operator has at least two characters and a container three, so four characters take at most a
    microsecond and 100 bytes. Operations that take more charge it themselves.
    """
    return sum((node.end_col_offset or 0) - node.col_offset for node in nodes) >> 2


def lambda_closure(node: ast.Lambda) -> Closure:
    """The closure of a lambda function."""
    arguments, body = node.args, _closure(node.body)
    positional = [a.arg for a in (*arguments.posonlyargs, *arguments.args)]
    defaults = [_closure(default) for default in arguments.defaults]
    last = {name: index for index, name in enumerate(positional)}
    # each variable of the function takes at most 64 bytes
    steps = 2 + len(positional) + steps_of(node.body)
    rest = arguments.vararg.arg if arguments.vararg else None
    if arguments.kwonlyargs or arguments.kwarg:
        raise InvalidExpression("a lambda function can have only plain parameters here", node.col_offset)

    def make(env: Environment) -> Value:
        env.budget.charge(_FUNCTION_STEPS)
        given = [default(env) for default in defaults]

        def function(*values: Value, **named: Value) -> Value:
            variables = dict(zip(positional[len(positional) - len(given) :], given, strict=True))
            variables.update(zip(positional, values, strict=False))
            if rest is not None:
                variables[rest] = tuple(values[len(positional) :])
            elif len(values) > len(positional):
                raise TypeError(
                    f"the function takes {len(positional)} arguments, but {len(values)} were given"
                )
            for name, value in named.items():
                if last.get(name, -1) < len(values):
                    raise TypeError(f"the function got an unexpected argument '{name}'")
                variables[name] = value
            missing = [name for name in positional if name not in variables]
            if missing:
                raise TypeError(f"the call lacks the argument '{missing[0]}'")
            budget = env.budget
            budget.charge(steps)
            budget.enter()
            try:
                return body(CallFrame(env, variables))
            finally:
                budget.leave()

        return function

    return make


Binder = Callable[[CallFrame, Value], None]


def _target(node: ast.expr) -> Binder:
    """The function that assigns an item to the variables of a loop."""
    if isinstance(node, ast.Name):
        name = node.id

        def bind_name(frame: CallFrame, value: Value) -> None:
            frame.variables[name] = value

        return bind_name
    if not isinstance(node, ast.Tuple | ast.List) or any(isinstance(n, ast.Starred) for n in node.elts):
        raise InvalidExpression("the variables of a loop must be plain names here", node.col_offset)
    binders = [_target(element) for element in node.elts]

    def bind_names(frame: CallFrame, value: Value) -> None:
        frame.budget.measure(value)
        frame.budget.spread(value)
        values = list(value)
        if len(values) != len(binders):
            raise ValueError(f"{len(values)} values to unpack into {len(binders)} names")
        for binder, item in zip(binders, values, strict=True):
            binder(frame, item)

    return bind_names


def _loops(
    generators: list[ast.comprehension], *results: ast.expr
) -> Callable[[Environment], Iterator[CallFrame]]:
    """Iterates over the frames of a comprehension's innermost loop, in which `results` are evaluated."""
    parts = []
    for generator in generators:
        if generator.is_async:
            raise InvalidExpression("async is not allowed in an expression")
        tests = [_closure(test) for test in generator.ifs]
        steps = 1 + steps_of(*generator.ifs, *(results if generator is generators[-1] else ()))
        parts.append((_closure(generator.iter), _target(generator.target), tests, steps))

    def run(env: Environment, frame: CallFrame, level: int) -> Iterator[CallFrame]:
        iterable, bind, tests, steps = parts[level]
        budget = frame.budget
        items = iterable(env)
        if type(items) is YamlList:  # each access copies an item
            budget.weigh(items)
        for item in items:
            budget.charge(steps)
            bind(frame, item)
            if all(test(frame) for test in tests):
                if level + 1 < len(parts):
                    yield from run(frame, frame, level + 1)
                else:
                    yield frame

    return lambda env: run(env, CallFrame(env, {}), 0)


def list_comprehension_closure(node: ast.ListComp) -> Closure:
    """The closure of a list comprehension."""
    loops, element = _loops(node.generators, node.elt), _closure(node.elt)
    return lambda env: env.budget.checked([element(frame) for frame in loops(env)])


def set_comprehension_closure(node: ast.SetComp) -> Closure:
    """The closure of a set comprehension."""
    loops, element = _loops(node.generators, node.elt), _closure(node.elt)

    def make(env: Environment) -> Value:
        values = [element(frame) for frame in loops(env)]
        env.budget.keys(0, values)
        return env.budget.checked(set(values))

    return make


def generator_closure(node: ast.GeneratorExp) -> Closure:
    """The closure of a generator expression."""
    loops, element = _loops(node.generators, node.elt), _closure(node.elt)
    return lambda env: Counted(env.budget, (element(frame) for frame in loops(env)))


def dict_comprehension_closure(node: ast.DictComp) -> Closure:
    """The closure of a dict comprehension."""
    loops = _loops(node.generators, node.key, node.value)
    key, value = _closure(node.key), _closure(node.value)

    def make(env: Environment) -> Value:
        pairs = [(key(frame), value(frame)) for frame in loops(env)]
        env.budget.keys(0, [name for name, _ in pairs])
        return env.budget.checked(dict(pairs))

    return make
