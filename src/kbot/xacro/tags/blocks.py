"""`xacro:insert_block`, `xacro:element` and `xacro:attribute`."""

from __future__ import annotations

from kbot.text.suggest import did_you_mean
from kbot.text.xml import Element
from kbot.xacro.binding import FAILED
from kbot.xacro.expander import Expander
from kbot.xacro.faults import Fault
from kbot.xacro.location import locate
from kbot.xacro.place import Node, Place
from kbot.xacro.scope import Scope
from kbot.xacro.tags.attributes import check_attributes


def insert_block(walk: Expander, node: Element, place: Place, has_next: bool) -> None:
    """Put a block here, expanded again: its element, or (`**`) what stands within it."""
    check_attributes(walk.run, node, place, ("name",))
    name, scope = node.attributes["name"], place.scope
    several = scope.find(f"**{name}")
    found = scope.find(f"*{name}") if several is None else several
    if found is None:
        raise _undefined(name, node, place, scope)
    block: Element = found.value
    if block.children:  # nodes without expressions are shared, and count each time
        walk.run.nodes -= sum(1 for _ in block.descendants())
    if several is None:
        place.out.append(walk.element(block, place))
        return
    scratch = block.made_by(place.call, block.tag, {})
    attributes = walk.attributes(block, scope, place.call, scratch)
    content: list[Node] = []
    walk.children(block.children, place.within(attributes, content))
    walk.splice(content, place)


def _undefined(name: str, node: Element, place: Place, scope: Scope) -> Fault:
    known = scope.find(name)
    if known is not None and known.state == FAILED and known.problem is not None:
        return Fault("X129", "", problem=known.problem)
    hint: str = did_you_mean(name, scope.blocks())
    if not hint and known is not None:
        hint = f"'{name}' is a property with a value: write ${{{name}}}"
    origin = locate(node, "name", place.call, None)
    fault = Fault("X129", f"the block '{name}' is not defined", hint, key=("block", name), origin=origin)
    fault.near = bool(hint)
    return fault


def make_element(walk: Expander, node: Element, place: Place, has_next: bool) -> None:
    """An element whose name is computed; it may be one of xacro's own."""
    if "xacro:name" not in node.attributes:
        raise Fault("X120", "<xacro:element> has no attribute 'xacro:name'")
    name = walk.evaluated(node, "xacro:name", place)
    if not name:
        origin = locate(node, "xacro:name", place.call, None)
        raise Fault("X130", "the element's name is empty", origin=origin)
    attributes = {key: value for key, value in node.attributes.items() if key != "xacro:name"}
    renamed = node.made_by(node.call, walk.run.budget.text(name), attributes)
    renamed.children = node.children
    if renamed.tag.startswith("xacro:"):
        walk.tag(renamed, place, has_next)
    else:
        place.out.append(walk.element(renamed, place))


def set_attribute(walk: Expander, node: Element, place: Place, has_next: bool) -> None:
    """Give the element around an attribute whose name is computed."""
    for required in ("name", "value"):
        if required not in node.attributes:
            raise Fault("X120", f"<xacro:attribute> has no attribute '{required}'")
    name = walk.evaluated(node, "name", place)
    value = walk.evaluated(node, "value", place)
    origin = locate(node, "value", place.call, None)
    if not name:
        raise Fault("X130", "the attribute's name is empty", origin=locate(node, "name", place.call, None))
    if not value and value != "":
        # the official writer leaves out what is false and no text
        walk.run.warn_at(
            "X212", f"the value {value!r} is written as an empty text", origin, "write ${str(…)}"
        )
        value = ""
    if place.parent is None:
        hint = "put it directly within the element that is to have it"
        walk.run.warn_at("X211", "the attribute is lost: it belongs to a xacro tag", node.origin, hint)
        return
    key = walk.run.budget.text(name)
    place.attributes[key] = walk.run.budget.text(value)
    place.parent.moved = {**(place.parent.moved or {}), key: origin}
