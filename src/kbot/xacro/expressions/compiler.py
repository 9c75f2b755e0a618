"""Compiles the expressions of `${…}` to closures, and caches them.

Most expressions are a name, a number, a look-up, or two of these with an operator. One regular expression
parses them. Python's parser, which is slower, parses all others.
"""

from __future__ import annotations

import re

from kbot.xacro.expressions import operations
from kbot.xacro.expressions.operations import Closure, InvalidExpression
from kbot.xacro.values import Value, YamlDict, wrap

TYPE_CHECKING = False
if TYPE_CHECKING:
    import ast

    from kbot.xacro.expressions.operations import Environment

MAX_CHARACTERS = 20_000
"""Characters of the longest expression that Python's parser gets."""

_KEYWORDS = frozenset(
    [
        "False",
        "None",
        "True",
        "and",
        "as",
        "assert",
        "async",
        "await",
        "break",
        "class",
        "continue",
        "def",
        "del",
        "elif",
        "else",
        "except",
        "finally",
        "for",
        "from",
        "global",
        "if",
        "import",
        "in",
        "is",
        "lambda",
        "nonlocal",
        "not",
        "or",
        "pass",
        "raise",
        "return",
        "try",
        "while",
        "with",
        "yield",
    ]
)
_OPERAND = r"""
    (?P<sign{0}>-\s*)?
    (?: (?P<name{0}>[A-Za-z_][A-Za-z0-9_]*) (?P<keys{0}>(?:\['[^'\\]*'\])*)
      | (?P<float{0}>[0-9]+\.[0-9]*|\.[0-9]+) | (?P<int{0}>[1-9][0-9]{{0,15}}|0) )"""
_SIMPLE = re.compile(
    rf"""{_OPERAND.format(1)} (?: \s* (?P<operator>[-+*/](?!\*)|[!=]=) \s*
         (?: {_OPERAND.format(2)} | '(?P<text>[^'\\]*)' ) )?\Z""",
    re.VERBOSE,
)
_OPERATORS = {"-": "Sub", "+": "Add", "*": "Mult", "/": "Div"}
_COMPARISONS = {"==": "Eq", "!=": "NotEq"}
_MAY_WARN = re.compile(r"\\|[0-9][A-Za-z]")
_cache: dict[str, Closure] = {}
_CACHE_SIZE = 20_000


def clear_cache() -> None:
    """Forget compiled expressions."""
    _cache.clear()


def compiled(expression: str) -> Closure:
    """The closure of an expression.

    Raises:
        InvalidExpression: it is not an expression.
        XacroError: X191, it uses a forbidden name.
    """
    closure = _cache.get(expression)
    if closure is None:
        if len(_cache) >= _CACHE_SIZE:
            _cache.clear()
        closure = _cache[expression] = _compile(expression)
    return closure


def is_identifier(name: str) -> bool:
    """Whether a text can be a name in an expression."""
    if name.isascii():
        return name.isidentifier() and name not in _KEYWORDS
    import unicodedata  # rarely needed: start-up time

    return name.isidentifier() and unicodedata.normalize("NFKC", name) == name


def _compile(expression: str) -> Closure:
    source = expression.strip()
    if source.isascii() and source.isidentifier() and source not in _KEYWORDS:
        return operations.name_closure(source)
    match = _SIMPLE.match(source)
    if match:
        simple = _simple(match)
        if simple is not None:
            return simple
    if len(source) > MAX_CHARACTERS:
        raise InvalidExpression(f"the expression is longer than {MAX_CHARACTERS:,} characters")
    import ast  # imported lazily: simple expressions need no parser

    from kbot.xacro.expressions.closures import closure_of

    try:
        if _MAY_WARN.search(source):
            import warnings

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
        if "is" in source:  # as in Python's compiler, equal constants of an expression are one object
            known: dict[tuple[type, str], Value] = {}
            for node in ast.walk(tree):
                if isinstance(node, ast.Constant):
                    node.value = known.setdefault((type(node.value), repr(node.value)), node.value)
        if "\n" in source:
            _count_columns_from_start(tree, source)
        return closure_of(tree.body)
    except RecursionError:
        raise InvalidExpression("the expression is nested too deeply") from None


def _count_columns_from_start(tree: ast.AST, source: str) -> None:
    """Change the columns of all nodes to offsets from the start, as if the source were a single line."""
    import ast

    starts = [0]
    for line in source.encode().splitlines(keepends=True):
        starts.append(starts[-1] + len(line))
    for node in ast.walk(tree):
        if isinstance(node, ast.expr):
            node.col_offset += starts[node.lineno - 1]
            node.end_col_offset = (node.end_col_offset or 0) + starts[(node.end_lineno or 1) - 1]


def _simple(match: re.Match[str]) -> Closure | None:
    """The closure of one operand, or of two with an operator."""
    left = _operand(match["sign1"], match["name1"], match["keys1"], match["float1"], match["int1"])
    operator = match["operator"]
    if left is None or operator is None:
        return left
    text = match["text"]
    right: Closure | None
    if text is None:
        right = _operand(match["sign2"], match["name2"], match["keys2"], match["float2"], match["int2"])
    else:
        right = lambda env: text  # noqa: E731 - a closure like the others
    if right is None:
        return None
    if operator in _OPERATORS:
        return operations.operation(_OPERATORS[operator], left, right)
    return operations.comparison(_COMPARISONS[operator], left, right)


def _operand(
    sign: str | None, name: str | None, keys: str | None, real: str | None, integer: str | None
) -> Closure | None:
    if name is None:
        number: Value = float(real) if real is not None else int(integer or 0)
        number = -number if sign else number
        return lambda env: number
    if name in _KEYWORDS or name.startswith("__"):
        return None
    value = _lookup(name, keys[2:-2].split("']['")) if keys else operations.name_closure(name)
    return operations.negation(value) if sign else value


def _lookup(name: str, keys: list[str]) -> Closure:
    """The closure of `name['key']['key']…`. Intermediate values are not wrapped, for speed."""

    def look_up(env: Environment) -> Value:
        value = env.lookup(name)
        is_yaml = False
        for key in keys:
            is_yaml = is_yaml or type(value) is YamlDict
            if is_yaml and isinstance(value, dict) and key in value:
                value = dict.__getitem__(value, key)
            else:
                value = operations.item(env.budget, wrap(value) if is_yaml else value, key)
                is_yaml = False
        if type(value) is float:
            return value
        return env.budget.checked(wrap(value) if is_yaml else value)

    return look_up
