"""The names and numbers in an expression, and whether each has the unit of the result."""

from __future__ import annotations

import ast
from dataclasses import dataclass
from functools import lru_cache
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Iterator

MOST_CHARACTERS = 1000
"""Characters of the longest expression that is analysed."""


@dataclass(frozen=True, slots=True)
class Operand:
    """A name, argument or number in an expression.

    kind       "name", "argument" or "number"
    text       the name, or the number as it is written
    start      the position of a number in the expression
    is_term    whether the result is this operand, with other terms added, or times a factor without a unit:
               a sign, a whole number, one half or two
    """

    kind: str
    text: str
    start: int
    is_term: bool


@lru_cache(maxsize=4096)  # most expressions occur again after each edit
def operands(expression: str, signs: frozenset[str] = frozenset()) -> tuple[Operand, ...]:
    """The operands of an expression in their order. Empty if it cannot be analysed.

    `signs` are the names whose value is 1 or -1: as a factor, as in `side * gap`, such a name has no unit.
    """
    if len(expression) > MOST_CHARACTERS:
        return ()
    blank = expression.translate({10: " ", 13: " ", 9: " "})  # positions are columns of a single line
    try:
        tree = ast.parse(blank.strip(), mode="eval").body
        found = list(_operands(tree, True, signs))
    except (SyntaxError, ValueError, RecursionError, MemoryError):
        return ()
    data, shift = blank.strip().encode(), len(blank) - len(blank.lstrip())  # the parser counts bytes
    return tuple(
        Operand(kind, data[start:end].decode(), len(data[:start].decode()) + shift, is_term)
        if kind == "number"
        else Operand(kind, name, 0, is_term)
        for kind, name, start, end, is_term in found
    )


def _operands(
    node: ast.expr, is_term: bool, signs: frozenset[str]
) -> Iterator[tuple[str, str, int, int, bool]]:
    """Kind, name, start, end and `is_term` of each operand."""
    parts: list[tuple[ast.expr, bool]]
    match node:
        case ast.Name(id=name):
            yield "name", name, 0, 0, is_term
            return
        case ast.Constant(value=value):
            if type(value) in (int, float):
                yield "number", "", node.col_offset, node.end_col_offset or 0, is_term
            return
        case ast.Call(
            func=ast.Name(id="arg") | ast.Attribute(attr="arg"), args=[ast.Constant(value=str(name))]
        ):
            yield "argument", name, 0, 0, is_term
            return
        case ast.UnaryOp(op=ast.USub() | ast.UAdd(), operand=operand):
            parts = [(operand, is_term)]
        case ast.BinOp(op=ast.Add() | ast.Sub(), left=left, right=right):
            parts = [(left, is_term), (right, is_term)]
        case ast.BinOp(op=ast.Mult(), left=left, right=right):
            parts = [
                (left, is_term and _has_no_unit(right, signs)),
                (right, is_term and _has_no_unit(left, signs)),
            ]
        case ast.BinOp(op=ast.Div(), left=left, right=right):
            parts = [(left, is_term and _has_no_unit(right, signs)), (right, False)]
        case ast.IfExp(test=test, body=body, orelse=orelse):
            parts = [(test, False), (body, is_term), (orelse, is_term)]
        case _:
            parts = [(child, False) for child in ast.iter_child_nodes(node) if isinstance(child, ast.expr)]
    for part, is_term_too in parts:
        yield from _operands(part, is_term_too, signs)


def _has_no_unit(node: ast.expr, signs: frozenset[str]) -> bool:
    """Whether a factor is a number without a unit: whole or one half, with either sign, or one of `signs`."""
    if isinstance(node, ast.UnaryOp) and isinstance(node.op, ast.USub):
        node = node.operand
    if isinstance(node, ast.Name):
        return node.id in signs
    return isinstance(node, ast.Constant) and (type(node.value) is int or node.value in (0.5, 2.0))
