"""Units of properties and arguments, from the URDF attributes that use them."""

from __future__ import annotations

import ast
from collections.abc import Iterator
from functools import lru_cache
from typing import TYPE_CHECKING

from kbot.model.quantities import quantity_of
from kbot.xacro.templates import pieces
from kbot.xacro.xacro_error import XacroError

if TYPE_CHECKING:
    from kbot.text.xml import Element
    from kbot.xacro import Expansion
    from kbot.xacro.binding import Binding

UNITS = {"length": "m", "angle": "rad", "mass": "kg"}
ARG = "arg "
"""The start of a command that looks up an argument."""
MOST_NAMES = 10_000
"""Uses of names that are followed. A description with more has no units in the page."""
MOST_CHARACTERS = 1000
"""Characters of the longest expression that is analysed."""


def units_of(expansion: Expansion) -> dict[int, str]:
    """Return the units of the bindings of an expansion, by `id`.

    A value has the unit of an attribute if the attribute is computed from it by sums, by signs, and by
    products with and quotients by whole numbers and one half. Other factors may have units of their own. A
    value whose uses disagree has no unit.
    """
    found: dict[int, str] = {}
    document = expansion.document
    if document is None:
        return found
    arguments = {f"{ARG}{name}": binding for name, binding in expansion.defaults.items()}
    waiting = [use for element in (document, *document.descendants()) for use in _uses_of(element)]
    seen: set[tuple[int, str]] = set()
    while waiting:
        text, inputs, unit = waiting.pop()
        by_name = {binding.name: binding for binding in inputs} | arguments
        # a factor of -1, as in `${side * gap}`, is the sign of a side
        signs = frozenset(name for name, binding in by_name.items() if binding.value in (-1, "-1"))
        for name in _terms_of(text, signs):
            binding = by_name.get(name)
            if binding is None or (id(binding), unit) in seen:
                continue
            if len(seen) == MOST_NAMES:
                return {}
            seen.add((id(binding), unit))
            found[id(binding)] = unit if found.get(id(binding), unit) == unit else ""
            if binding.node is not None:
                waiting.append((binding.node.attributes.get(binding.attribute, ""), binding.inputs, unit))
    return found


def _uses_of(element: Element) -> Iterator[tuple[str, tuple[Binding, ...], str]]:
    """Text, inputs and unit of each attribute that implies a unit."""
    for attribute, inputs in (element.inputs or {}).items():
        unit = UNITS.get(quantity_of(element.tag, attribute))
        if unit is not None:
            yield element.attribute_origin(attribute).span.text, inputs, unit


def _terms_of(text: str, signs: frozenset[str]) -> Iterator[str]:
    """The names and commands in a text that have the unit of the text."""
    if "$" not in text:
        return
    try:
        found = pieces(text)
    except XacroError:
        return
    for piece in found:
        if piece.kind == "expression":
            yield from _terms(piece.content, signs)
        elif piece.kind == "command":
            yield piece.content


@lru_cache(maxsize=4096)  # most expressions occur again after each edit
def _terms(expression: str, signs: frozenset[str]) -> tuple[str, ...]:
    if len(expression) > MOST_CHARACTERS:
        return ()
    try:
        waiting = [ast.parse(expression.strip(), mode="eval").body]
    except (SyntaxError, ValueError, RecursionError, MemoryError):
        return ()
    names = []
    while waiting:
        match waiting.pop():
            case ast.Name(id=name):
                names.append(name)
            case ast.UnaryOp(op=ast.USub() | ast.UAdd(), operand=operand):
                waiting.append(operand)
            case ast.BinOp(op=ast.Add() | ast.Sub(), left=left, right=right):
                waiting += (left, right)
            case ast.BinOp(op=ast.Mult(), left=left, right=right):
                waiting += [a for a, b in ((left, right), (right, left)) if _is_plain(b, signs)]
            case ast.BinOp(op=ast.Div(), left=left, right=right):
                waiting += [left] if _is_plain(right, signs) else []
    return tuple(names)


def _is_plain(node: ast.expr, signs: frozenset[str]) -> bool:
    """Whether a factor is a number without a unit: whole or one half, with either sign, or one of `signs`."""
    if isinstance(node, ast.UnaryOp) and isinstance(node.op, ast.USub):
        node = node.operand
    if isinstance(node, ast.Name):
        return node.id in signs
    return isinstance(node, ast.Constant) and (type(node.value) is int or node.value in (0.5, 2.0))
