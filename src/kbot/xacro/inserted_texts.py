"""Explains expressions that contain `$(…)`, whose text becomes a part of the expression without quotes."""

from __future__ import annotations

import ast
import re
import warnings

from kbot.text.suggest import Suggestion
from kbot.xacro.not_a_number import QUOTED
from kbot.xacro.templates import Piece, pieces, shortened
from kbot.xacro.xacro_error import XacroError

TYPE_CHECKING = False
if TYPE_CHECKING:
    from collections.abc import Mapping

    from kbot.xacro.templates import Names

_WORD = re.compile(r"[A-Za-z_]\w*")
_NUMBER_LIKE = re.compile(r"\s*[-+.]?\d")
"""The start of a number. One with a unit or a decimal comma has its own explanation."""


def in_expression(fault: XacroError, content: str, scope: Names) -> XacroError:
    """The fault of an expression that contains `$(…)`, explained if `$(…)` is its cause."""
    if fault.problem is not None or fault.is_elsewhere:
        return fault
    if fault.code == "X112" and isinstance(fault.hint, Suggestion) and not fault.hint.nearest:
        name = fault.hint.written
        fault.hint = Suggestion(f"inside ${{ }}, write only its name: {name}", name)
        fault.key = ("argument", name, "expression")
    elif fault.code in ("X102", "X103"):
        return _text_without_quotes(fault, content, scope) or fault
    return fault


def _text_without_quotes(fault: XacroError, content: str, scope: Names) -> XacroError | None:
    """The fault of a text that `$(…)` inserts into an expression without quotes. None for another fault."""
    words, tree = _with_words(content)
    if tree is None:
        return None
    parents = _parents(tree)
    names = [node for node in ast.walk(tree) if isinstance(node, ast.Name)]
    unknown = fault.key[1] if fault.code == "X103" and isinstance(fault.key, tuple) else ""
    if any(node.id == unknown for node in names):
        return None
    for node in names:
        if node.id not in words:
            continue
        value = scope.substitute(words[node.id].content)
        is_cause = unknown in _WORD.findall(value) if unknown else _parsed(value) is None
        is_text = _is_text(node, parents)
        if is_cause and (is_text or not _NUMBER_LIKE.match(value)):
            return _unquoted(fault, words[node.id], value, _quote(content) if is_text else "")
    return None


def comparison(text: str) -> str:
    """The expression that a condition without `${}` means, such as `$(arg kind) == 'gz'`, with quotes around
    the texts of arguments. Empty if the condition does not compare."""
    if "${" in text:
        return ""
    words, tree = _with_words(text)
    if tree is None or not isinstance(tree.body, ast.Compare):
        return ""
    parents = _parents(tree)
    quoted = {node.id for node in parents if isinstance(node, ast.Name) and _is_text(node, parents)}
    quote = {word: _quote(text) if word in quoted else "" for word in words}
    commands = (f"{quote[word]}$({piece.content}){quote[word]}" for word, piece in words.items())
    return (
        f"${{{''.join(next(commands) if p.kind == 'command' else p.content for p in pieces(text)).strip()}}}"
    )


def _with_words(content: str) -> tuple[dict[str, Piece], ast.Expression | None]:
    """The piece of each word, and the parsed expression in which these words replace every `$(…)`.

    The expression is None if it is not valid."""
    parts = {f"inserted_{index}_": piece for index, piece in enumerate(pieces(content))}
    words = {word: piece for word, piece in parts.items() if piece.kind == "command"}
    return words, _parsed("".join(word if word in words else piece.content for word, piece in parts.items()))


def _unquoted(fault: XacroError, piece: Piece, value: str, quote: str) -> XacroError:
    inserted = f"$({piece.content})"
    what = f"the text '{shortened(value, QUOTED)}' of {inserted} has no quotes"
    if not quote:
        hint = fault.hint if fault.near else "give it a number or the name of a property"
        return XacroError(fault.code, f"{fault.message}, which is the value of {inserted}", hint)
    hint = f"quote it: {quote}{inserted}{quote}" if quote not in value else ""
    return XacroError(fault.code, f"{what}, so it is read as an expression", hint)


def _quote(content: str) -> str:
    """The quote that the author of an expression uses."""
    return '"' if '"' in content else "'"


def _parents(tree: ast.Expression) -> dict[ast.AST, ast.AST]:
    """The node that contains each node of an expression."""
    return {node: parent for parent in ast.walk(tree) for node in ast.iter_child_nodes(parent)}


def _is_text(node: ast.Name, parents: Mapping[ast.AST, ast.AST]) -> bool:
    """Whether a part of an expression is used as a text, so that it is right with quotes."""
    match parent := parents.get(node):
        case ast.Compare(ops=[ast.Eq() | ast.NotEq() | ast.In() | ast.NotIn()]):
            others = [part for part in (parent.left, *parent.comparators) if part is not node]
            return all(_holds_text(other) for other in others)
        case ast.Subscript():
            return parent.slice is node
        case ast.BinOp(op=ast.Add()):
            return _holds_text(parent.right if parent.left is node else parent.left)
    return False


def _holds_text(node: ast.expr) -> bool:
    match node:
        case ast.Constant():
            return isinstance(node.value, str)
        case ast.List() | ast.Tuple():
            return all(_holds_text(item) for item in node.elts)
    return False


def _parsed(source: str) -> ast.Expression | None:
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            return ast.parse(source.strip(), mode="eval")
    except (SyntaxError, ValueError, MemoryError, RecursionError):
        return None
