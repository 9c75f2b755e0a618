"""What the page's editor completes: URDF and xacro elements, and the names in a description."""

from __future__ import annotations

from collections.abc import Iterable, Mapping

from kbot.checks.facts.vocabulary import ATTRIBUTES, CHILDREN
from kbot.model import JointType
from kbot.text import Element
from kbot.workbench.protocol import AttributeValues, Completions, ElementNames, NamedValue
from kbot.workbench.source.description import DescriptionReading
from kbot.xacro import Expansion
from kbot.xacro.binding import Binding
from kbot.xacro.macros import Macro
from kbot.xacro.tags import TAGS
from kbot.xacro.tags.attributes import ATTRIBUTES as XACRO_ATTRIBUTES
from kbot.xacro.templates import shortened

MOST_NAMES = 2000
"""Names of one kind that are sent. A list of more is of no use in an editor."""
MOST_CHARACTERS = 60
"""Characters of a value that are sent. The list is at most 560 px wide, and a longer value does not fit
beside its name."""


def completions_of(reading: DescriptionReading) -> Completions | None:
    """Return what can be completed in a description, or None if its text is not well-formed."""
    expansion = reading.expansion
    if expansion is None or expansion.document is None:
        return None
    links, joints, materials = (_names(expansion.document, tag) for tag in ("link", "joint", "material"))
    return Completions(
        elements=(*_urdf_elements(), *_xacro_elements(), *_macro_calls(expansion)),
        values=(
            AttributeValues("joint", "type", tuple(JointType)),
            AttributeValues("parent", "link", links),
            AttributeValues("child", "link", links),
            AttributeValues("mimic", "joint", joints),
            AttributeValues("gazebo", "reference", (*links, *joints)),
            AttributeValues("material", "name", materials),
        ),
        properties=_values(expansion.scope.values if expansion.scope is not None else {}),
        arguments=_values(expansion.defaults),
    )


def _urdf_elements() -> Iterable[ElementNames]:
    for name, attributes in ATTRIBUTES.items():
        yield ElementNames(name, attributes, CHILDREN.get(name, ()))
    yield ElementNames("gazebo", ("reference",), ())


def _xacro_elements() -> Iterable[ElementNames]:
    for tag in TAGS:
        required, optional = XACRO_ATTRIBUTES.get(tag, ((), ()))
        yield ElementNames(tag, (*required, *optional), ())


def _macro_calls(expansion: Expansion) -> Iterable[ElementNames]:
    if expansion.macros is None:
        return
    for name in expansion.macros.names()[:MOST_NAMES]:
        macro = expansion.macros.find(name)
        parameters = macro.parameters if isinstance(macro, Macro) else ()
        yield ElementNames(f"xacro:{name}", tuple(p.name for p in parameters if not p.is_block), ())


def _names(document: Element, tag: str) -> tuple[str, ...]:
    """Return the names of all elements with a tag in the expanded document."""
    elements = (element for element in document.descendants() if element.tag == tag)
    names = dict.fromkeys(name for element in elements if (name := element.attributes.get("name")))
    return tuple(names)[:MOST_NAMES]


def _values(bindings: Mapping[str, Binding]) -> tuple[NamedValue, ...]:
    named = [binding for name, binding in bindings.items() if not name.startswith("*")]
    return tuple(NamedValue(b.name, _shown(b)) for b in named[:MOST_NAMES])


def _shown(binding: Binding) -> str:
    """Return a value as text, or as it is written if it is a list or a dictionary."""
    value = binding.value
    text = str(value) if isinstance(value, str | int | float | bool) else ""
    return shortened(text, MOST_CHARACTERS)
