"""The context of the walk over a description: scope, macros and calls."""

from __future__ import annotations

from kbot.text.span import Call
from kbot.text.xml import Element, Text
from kbot.xacro.macros import MacroTable
from kbot.xacro.scope import Scope

Node = Element | Text


class ExpansionContext:
    """The visible names, the calls that led here, and where the result goes.

    `attributes` and `parent` belong to the element whose children are being expanded. `parent` is None within
    a xacro tag, because its attributes are not part of the result.
    """

    __slots__ = ("attributes", "call", "macros", "out", "parent", "scope")

    def __init__(
        self,
        scope: Scope,
        macros: MacroTable,
        call: Call | None,
        attributes: dict[str, str],
        out: list[Node],
        parent: Element | None = None,
    ) -> None:
        self.scope = scope
        self.macros = macros
        self.call = call
        self.attributes = attributes
        self.out = out
        self.parent = parent

    def within(self, attributes: dict[str, str], out: list[Node]) -> ExpansionContext:
        """The same place with a separate result, for the content of a xacro tag."""
        return ExpansionContext(self.scope, self.macros, self.call, attributes, out)
