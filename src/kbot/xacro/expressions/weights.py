"""What evaluating a part of an expression takes at least: known from its syntax tree, before any value is.

Loops and lambda functions charge it each time that their body runs.
"""

from __future__ import annotations

import ast

_PER_STEP = 8
_WEIGHTS: dict[type[ast.AST], int] = {
    ast.Call: 16,
    ast.Lambda: 24,
    ast.Attribute: 4,
    ast.Subscript: 4,
    ast.List: 8,
    ast.Tuple: 8,
    ast.Dict: 40,  # a dictionary of one entry takes 232 bytes, a set as much
    ast.Set: 40,
    ast.ListComp: 40,
    ast.SetComp: 72,
    ast.DictComp: 72,
    ast.GeneratorExp: 40,
    ast.JoinedStr: 8,
    ast.FormattedValue: 16,
}
"""In eighths of a step: every other node takes one, 0.1 us and 8 bytes."""


def weigh(tree: ast.AST) -> None:
    """Note the weight of each node, with all beneath it. By a list, for trees of any depth."""
    nodes = [tree]
    for node in nodes:
        nodes.extend(ast.iter_child_nodes(node))
    for node in reversed(nodes):
        beneath = sum(child.weight for child in ast.iter_child_nodes(node))  # type: ignore[attr-defined]  # set by this loop
        node.weight = _WEIGHTS.get(type(node), 1) + beneath  # type: ignore[attr-defined]  # read by steps_of


def steps_of(*nodes: ast.AST) -> int:
    """The steps that evaluating the nodes takes."""
    return sum(node.weight for node in nodes) // _PER_STEP  # type: ignore[attr-defined]  # set by weigh
