"""The handlers of the xacro tags, by tag name."""

from __future__ import annotations

from kbot.xacro.tags.calls import (
    call_by_name,
    call_macro,
    define_macro,
    insert_block,
    make_element,
    set_attribute,
)
from kbot.xacro.tags.conditions import condition
from kbot.xacro.tags.includes import include
from kbot.xacro.tags.properties import declare_argument, define_property

TYPE_CHECKING = False
if TYPE_CHECKING:
    from kbot.xacro.expander import Handler

TAGS: dict[str, Handler] = {
    "xacro:if": condition,
    "xacro:unless": condition,
    "xacro:property": define_property,
    "xacro:arg": declare_argument,
    "xacro:macro": define_macro,
    "xacro:call": call_by_name,
    "xacro:include": include,
    "xacro:insert_block": insert_block,
    "xacro:element": make_element,
    "xacro:attribute": set_attribute,
}

__all__ = ["TAGS", "call_macro"]
