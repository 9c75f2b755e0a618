"""Evaluates texts with `${expression}` and `$(command)`, and the escapes `$${` and `$$(`."""

from __future__ import annotations

import re
from collections.abc import Callable

from kbot.xacro.expressions.compiler import compiled
from kbot.xacro.expressions.operations import InvalidExpression
from kbot.xacro.values import Value
from kbot.xacro.xacro_error import LimitFault, XacroError

TYPE_CHECKING = False
if TYPE_CHECKING:
    from typing import Protocol

    from kbot.xacro.expressions.operations import Environment

    class Names(Environment, Protocol):
        """The scope in which a text is evaluated."""

        def substitute(self, content: str) -> str:
            """The value of `$(content)`."""


_PIECE = re.compile(
    r"""(?P<escaped>\$\$+[{(])          # several dollars before a bracket: one is removed
      | \$\{(?P<expression>[^}]*)\}
      | \$\((?P<command>[^)]*)\)
      | (?P<plain>[^$]+|\$[^{($]+|\$$)  # no dollar, or a dollar that begins nothing
    """,
    re.VERBOSE,
)
_UNCLOSED = re.compile(r"\$+[{(]?")
EXPRESSION_ERRORS = (
    ArithmeticError, AttributeError, LookupError, MemoryError, NameError, RecursionError, RuntimeError,
    TypeError, ValueError,
)  # fmt: skip


_WRONG_KINDS = re.compile(
    r"unsupported operand|can only concatenate|can't multiply|bad operand|must be real number|"
    r"'.*' not supported"
)
"""Python's words for an operand of the wrong type."""
_MOST_PIECES = 50_000
"""Expressions, commands and the words between them in one text."""
_SHORT = 64
"""Characters of a text that is evaluated for free, for speed. The number of nodes and the total length of
evaluated texts are limited too."""
_SURROGATE = re.compile(r"[\ud800-\udfff]")
_RENAME = "rename the file or folder: XML cannot contain this name"
_BYTE_OF_A_NAME = re.compile(r"[\udc80-\udcff]")
"""What Python reads for a byte of a file name that is not UTF-8."""


class Piece:
    """A piece of a text, from `start` to `end`. `kind` is "text", "expression" or "command"."""

    __slots__ = ("content", "end", "kind", "start")

    def __init__(self, kind: str, content: str, start: int, end: int) -> None:
        self.kind = kind
        self.content = content
        self.start = start
        self.end = end


def pieces(text: str) -> list[Piece]:
    """Split a text into pieces.

    Raises:
        XacroError: X101, an expression or command is not closed, or a dollar sign is misplaced.
    """
    found: list[Piece] = []
    at = 0
    while at < len(text):
        match = _PIECE.match(text, at)  # a search would try each position in a row of dollars
        if match is None:
            raise _unclosed(text, at)
        start, end = match.span()
        if len(found) >= _MOST_PIECES:
            raise LimitFault(
                "X190", f"a text has more than {_MOST_PIECES:,} parts (expressions and the text between them)"
            )
        at = end
        kind = match.lastgroup
        if kind == "plain":
            found.append(Piece("text", match[0], start, end))
        elif kind == "escaped":
            found.append(Piece("text", match[0][1:], start, end))
        else:
            found.append(
                Piece("expression" if kind == "expression" else "command", match[0][2:-1], start, end)
            )
    return found


def _unclosed(text: str, at: int) -> XacroError:
    match = _UNCLOSED.match(text, at)
    mark = match[0] if match else text[at]
    closing = {"{": "}", "(": ")"}.get(mark[-1])
    if closing:
        mark = shortened(mark, 20)
        hint = f"close it with '{closing}', or write '${mark}' for a literal '{mark}'"
        fault = XacroError("X101", f"'{mark}' is not closed", hint)
    else:
        fault = XacroError("X101", f"'{shortened(mark, 20)}' begins neither '${{' nor '$('")
    fault.part = (at, match.end() if match else at + 1)
    return fault


Evaluator = Callable[["Names"], Value]


class Template:
    """A text split into pieces, with compiled expressions, ready to be evaluated in any scope."""

    __slots__ = ("_evaluators", "_single", "_steps", "text")

    def __init__(self, text: str) -> None:
        self.text = text
        content = text[2:-1]
        if text[:2] == "${" and text[-1] == "}" and "}" not in content and "$" not in content:
            evaluators = [_expression_evaluator(content, 0, len(text))]  # most texts are a single expression
        else:
            evaluators = [_evaluator(piece) for piece in pieces(text)]
        self._evaluators = evaluators
        self._single = evaluators[0] if len(evaluators) == 1 else None
        self._steps = len(text) >> 2 if len(text) > _SHORT else 0  # as in `steps_of`

    def value(self, scope: Names) -> Value:
        """The value of the text. It keeps its type if the text is a single expression, and is text otherwise.

        Raises:
            XacroError: with the part of the text that caused it.
        """
        done = 0
        try:
            if self._steps:
                scope.budget.charge(self._steps)
            if self._single is not None:
                return _writable(self._single(scope))
            budget = scope.budget
            parts, size = [], 0
            for evaluate in self._evaluators:
                value = evaluate(scope)
                part = value if type(value) is str else budget.text(value)
                size += len(part)
                parts.append(part)
                done += 1
            if size > _SHORT:  # before the text is created
                budget.length(size)
                budget.charge(size >> 4)
            text = "".join(parts)
            if not text.isascii() and _SURROGATE.search(text):
                done = next(index for index, part in enumerate(parts) if _SURROGATE.search(part))
                _writable(parts[done])
            return text
        except XacroError as fault:
            if fault.part is None:
                found = pieces(self.text)[done : done + 1]  # none if only the whole text is too long
                fault.part = (found[0].start, found[0].end) if found else (0, len(self.text))
            raise


def _writable(value: Value) -> Value:
    """Return the value. Raises XacroError for text with a lone surrogate, which cannot be encoded."""
    if type(value) is str and not value.isascii() and _SURROGATE.search(value):
        if _BYTE_OF_A_NAME.search(value):
            raise XacroError("X104", "the text contains a file or folder name that is not UTF-8", _RENAME)
        raise XacroError("X104", "the text contains a lone surrogate, from U+D800 to U+DFFF")
    return value


_cache: dict[str, Template] = {}
_CACHE_SIZE = 20_000


def clear_cache() -> None:
    """Forget all templates."""
    _cache.clear()


def evaluate(text: str, scope: Names) -> Value:
    """The value of a text in a scope.

    Raises:
        XacroError: with the part of the text that caused it.
    """
    if "$" not in text:
        return text
    template = _cache.get(text)
    if template is None:
        if len(_cache) >= _CACHE_SIZE:
            _cache.clear()
        budget = scope.budget
        budget.steps -= len(text)  # compiling an expression takes about 1 us per character
        if budget.steps < 0:
            budget.charge(0)
        template = _cache[text] = Template(text)
    return template.value(scope)


def _evaluator(piece: Piece) -> Evaluator:
    kind, content = piece.kind, piece.content
    if kind == "text":
        return lambda scope: content
    if kind == "command":
        return lambda scope: scope.substitute(_text(content, scope))
    if "$" in content:
        return lambda scope: _substituted(content, scope)
    return _expression_evaluator(content, piece.start, piece.end)


def _expression_evaluator(content: str, start: int, end: int) -> Evaluator:
    """The evaluator of an expression. `start` and `end` are its position in the text."""
    try:
        closure = compiled(content)
    except InvalidExpression as error:
        fault = invalid(error, content)
        fault.part = (start, end)
        raise fault from None
    except XacroError as fault:
        fault.part = (start, end)
        raise

    def guarded(scope: Names) -> Value:
        try:
            return closure(scope)
        except EXPRESSION_ERRORS as error:
            raise failed(error, content, scope) from None

    return guarded


def _substituted(content: str, scope: Names) -> Value:
    """The value of an expression that contains `$(…)`, whose text becomes a part of the expression."""
    try:
        return expression(_text(content, scope), scope)
    except XacroError as fault:
        from kbot.xacro.inserted_texts import in_expression  # only for an error: start-up time

        raise in_expression(fault, content, scope) from None


def _text(content: str, scope: Names) -> str:
    try:
        value = evaluate(content, scope)
    except XacroError as fault:
        fault.part = None
        raise
    return value if type(value) is str else scope.budget.text(value)


def invalid(error: InvalidExpression, content: str) -> XacroError:
    """The fault of a syntax error."""
    from kbot.xacro.explanations import syntax_fault  # only for an error: start-up time

    return syntax_fault(error, content)


def expression(content: str, names: Environment) -> Value:
    """The value of an expression, as in `${…}` and in `$(eval …)`.

    Raises:
        XacroError: X102, the expression is not valid; X104, its evaluation fails; X190, it exceeds a limit.
    """
    names.budget.charge(len(content))
    try:
        closure = compiled(content)
    except InvalidExpression as error:
        raise invalid(error, content) from None
    try:
        return closure(names)
    except EXPRESSION_ERRORS as error:
        raise failed(error, content, names) from None


def failed(error: Exception, content: str, names: Environment) -> XacroError:
    """The fault of an expression that raised an error."""
    from kbot.xacro.explanations import failure  # only for an error: start-up time

    explained = failure(error, content, names)
    if explained is not None:
        return explained
    wanted = getattr(error, "wanted", None)
    hint = ""
    if wanted:
        from kbot.text.suggest import did_you_mean  # only for an error: start-up time

        hint = did_you_mean(wanted, getattr(error, "candidates", ()))
    reason = shortened(str(error)) or type(error).__name__
    if isinstance(error, KeyError):
        reason = f"there is no key {reason}"
    elif isinstance(error, RecursionError):
        reason = "it is nested too deeply"
    elif isinstance(error, MemoryError):
        reason = "it needs too much memory"
    elif isinstance(error, TypeError) and _WRONG_KINDS.match(reason):
        reason = "the operator or function needs numbers, but a value is not a number"
    return XacroError("X104", f"{reason}, in '{shortened(' '.join(content.split()), 60)}'", hint)


def shortened(text: str, size: int = 200) -> str:
    """A text, shortened to be quoted in a message."""
    return text if len(text) <= size else text[: size - 1] + "…"
