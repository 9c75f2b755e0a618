"""Lambda functions and comprehensions: closures with variables of their own."""

from __future__ import annotations

import ast
from collections.abc import Callable

from kbot.xacro.expressions.operations import Closure, Frame, InvalidExpression
from kbot.xacro.values import Value

TYPE_CHECKING = False
if TYPE_CHECKING:
    from collections.abc import Iterator

    from kbot.xacro.expressions.operations import Environment


def _closure(node: ast.expr) -> Closure:
    from kbot.xacro.expressions.closures import closure_of

    return closure_of(node)


def lambda_closure(node: ast.Lambda) -> Closure:
    """The closure of a lambda function."""
    arguments, body = node.args, _closure(node.body)
    positional = [a.arg for a in (*arguments.posonlyargs, *arguments.args)]
    defaults = [_closure(default) for default in arguments.defaults]
    rest = arguments.vararg.arg if arguments.vararg else None
    if arguments.kwonlyargs or arguments.kwarg:
        raise InvalidExpression("a lambda function takes plain parameters here", node.col_offset)

    def make(env: Environment) -> Value:
        given = [default(env) for default in defaults]

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


def list_comprehension_closure(node: ast.ListComp) -> Closure:
    """The closure of a list comprehension."""
    loops, element = _loops(node.generators), _closure(node.elt)
    return lambda env: env.budget.checked([element(frame) for frame in loops(env)])


def set_comprehension_closure(node: ast.SetComp) -> Closure:
    """The closure of a set comprehension."""
    loops, element = _loops(node.generators), _closure(node.elt)
    return lambda env: env.budget.checked({element(frame) for frame in loops(env)})


def generator_closure(node: ast.GeneratorExp) -> Closure:
    """The closure of a generator expression."""
    loops, element = _loops(node.generators), _closure(node.elt)
    return lambda env: (element(frame) for frame in loops(env))


def dict_comprehension_closure(node: ast.DictComp) -> Closure:
    """The closure of a dict comprehension."""
    loops, key, value = _loops(node.generators), _closure(node.key), _closure(node.value)
    return lambda env: env.budget.checked({key(frame): value(frame) for frame in loops(env)})
