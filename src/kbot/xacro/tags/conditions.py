"""The tags `xacro:if` and `xacro:unless`."""

from __future__ import annotations

from kbot.text.xml import Element
from kbot.xacro.expander import Expander
from kbot.xacro.expansion_context import ExpansionContext, Node
from kbot.xacro.macros import Macro
from kbot.xacro.tags.attributes import check_attributes
from kbot.xacro.xacro_error import Problem, XacroError


def condition(walk: Expander, node: Element, place: ExpansionContext, has_next: bool) -> None:
    """Expand the content of the tag, or remove it."""
    tail: list[Node] = []
    walk.gap.drop_comments(place.out, tail, has_next)
    check_attributes(walk.run, node, place)
    try:
        keep = walk.truth(walk.evaluated(node, "value", place), node, "value", place)
    except XacroError as fault:
        if fault.problem is None:  # a limit
            raise
        _poison_definitions(walk, node, place, fault.problem)
        return
    if keep is not (node.tag == "xacro:unless"):
        content: list[Node] = []
        walk.children(node.children, place.within({}, content))
        walk.splice(content, place)
    walk.splice(tail, place)


def _poison_definitions(walk: Expander, node: Element, place: ExpansionContext, problem: Problem) -> None:
    """Mark the names that an unexpanded tag defines, so that their uses are not reported as errors."""
    for child in node.elements():
        name = child.attributes.get("name", "")
        if child.tag == "xacro:property" and name not in place.scope:
            walk.poison(name, place.scope, child, place, problem)
        elif child.tag == "xacro:macro" and place.macros.find(name) is None:
            place.macros.own[name] = Macro(name, child, (), place.call, problem=problem)
        elif child.tag in ("xacro:if", "xacro:unless"):
            _poison_definitions(walk, child, place, problem)
        elif child.tag == "xacro:include":
            walk.run.incomplete = walk.run.incomplete or problem
