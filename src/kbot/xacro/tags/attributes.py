"""The attributes of xacro tags, and their check."""

from __future__ import annotations

from kbot.text.suggest import did_you_mean
from kbot.xacro.location import name_span
from kbot.xacro.xacro_error import XacroError

TYPE_CHECKING = False
if TYPE_CHECKING:
    from kbot.text.xml_nodes import Element
    from kbot.xacro.expansion_context import ExpansionContext
    from kbot.xacro.run import Run


ATTRIBUTES: dict[str, tuple[tuple[str, ...], tuple[str, ...]]] = {
    "xacro:if": (("value",), ()),
    "xacro:unless": (("value",), ()),
    "xacro:property": (("name",), ("value", "default", "remove", "scope", "lazy_eval")),
    "xacro:arg": (("name", "default"), ()),
    "xacro:macro": (("name",), ("params",)),
    "xacro:include": (("filename",), ("ns", "optional")),
    "xacro:insert_block": (("name",), ()),
    "xacro:attribute": (("name", "value"), ()),
}
"""The required and the optional attributes of each tag. `<xacro:call>` and `<xacro:element>` are missing,
because they have the attributes of the macro or the element that they name."""


def check_attributes(run: Run, node: Element, place: ExpansionContext) -> None:
    """Warn about unknown attributes of a tag.

    Raises:
        XacroError: a required attribute is missing.
    """
    attributes = node.attributes
    required, optional = ATTRIBUTES[node.tag]
    if tuple(attributes) == required:
        return
    known = (*required, *optional)
    unknown = [name for name in attributes if name not in known and not name.startswith("xmlns:")]
    for name in required:
        if name not in attributes:
            hint = f"'{unknown[0]}' was given" if did_you_mean(name, unknown) or len(unknown) == 1 else ""
            raise XacroError("X120", f"<{node.tag}> has no attribute '{name}'", hint)
    for name in unknown:
        hint = did_you_mean(name, [n for n in known if n not in attributes])
        run.warn_at(
            "X203",
            f"<{node.tag}> ignores the unknown attribute '{name}'",
            name_span(node, name, place.call),
            hint or f"its attributes are {', '.join(known)}",
        )
