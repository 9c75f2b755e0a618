"""A binding: the value of a name, evaluated or not yet, and where it was written."""

from __future__ import annotations

from kbot.text.span import Call, Origin
from kbot.text.xml import Element
from kbot.xacro.values import Value
from kbot.xacro.xacro_error import Problem

READY, LAZY, BUSY, FAILED = range(4)


class Binding:
    """A name's value in a scope, and where it was written.

    `node` and `attribute` are the element and attribute that hold the value. `call` is the macro call or
    include that led there. `inputs` are the bindings that the value was computed from. `is_given`: the caller
    gave another value than the one written there.
    """

    __slots__ = ("attribute", "call", "inputs", "is_given", "name", "node", "problem", "state", "value")

    def __init__(
        self, name: str, value: Value, state: int, node: Element | None, attribute: str, call: Call | None
    ) -> None:
        self.name = name
        self.value = value
        self.state = state
        self.node = node
        self.attribute = attribute
        self.call = call
        self.inputs: tuple[Binding, ...] = ()
        self.is_given = False
        self.problem: Problem | None = None

    def __repr__(self) -> str:
        return f"<{self.name} = {self.value!r}>"

    @property
    def origin(self) -> Origin | None:
        """Where the value was written."""
        if self.node is None:
            return None
        return Origin(self.node.attribute_origin(self.attribute).span, self.call)
