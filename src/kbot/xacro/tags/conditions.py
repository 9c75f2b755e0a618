"""`xacro:if` and `xacro:unless`."""

from __future__ import annotations

from kbot.text.xml import Element
from kbot.xacro.expander import Expander
from kbot.xacro.expansion_context import ExpansionContext, Node
from kbot.xacro.macros import Macro
from kbot.xacro.tags.attributes import check_attributes
from kbot.xacro.xacro_error import Problem, XacroError


def condition(walk: Expander, node: Element, place: ExpansionContext, has_next: bool) -> None:
    """Expand what stands within, or leave it out."""
    tail: list[Node] = []
    walk.gap.drop_comments(place.out, tail, has_next)
    check_attributes(walk.run, node, place, ("value",))
    try:
        keep = walk.truth(walk.evaluated(node, "value", place), node, "value", place)
    except XacroError as fault:
        if fault.problem is None:  # a limit
            raise
        _forgive(walk, node, place, fault.problem)
        return
    if keep is not (node.tag == "xacro:unless"):
        content: list[Node] = []
        walk.children(node.children, place.within({}, content))
        walk.splice(content, place)
    walk.splice(tail, place)


def _forgive(walk: Expander, node: Element, place: ExpansionContext, problem: Problem) -> None:
    """What a part that could not be expanded would have defined, is not to be missed."""
    for child in node.elements():
        name = child.attributes.get("name", "")
        if child.tag == "xacro:property" and name not in place.scope:
            walk.poison(name, place.scope, child, place, problem)
        elif child.tag == "xacro:macro" and place.macros.find(name) is None:
            place.macros.own[name] = Macro(name, child, (), place.call, problem=problem)
        elif child.tag in ("xacro:if", "xacro:unless"):
            _forgive(walk, child, place, problem)
        elif child.tag == "xacro:include":
            walk.run.incomplete = walk.run.incomplete or problem
