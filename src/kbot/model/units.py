"""Units of properties and arguments, from the URDF attributes that use them."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING

from kbot.model.quantities import quantity_of
from kbot.xacro.templates import pieces
from kbot.xacro.terms import operands
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
            yield from (o.text for o in operands(piece.content, signs) if o.kind == "name" and o.is_term)
        elif piece.kind == "command":
            yield piece.content
