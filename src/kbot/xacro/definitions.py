"""Lists the properties, blocks and macros of a description, and where each was defined."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

from kbot.text.span import Origin
from kbot.xacro.macros import Macro, MacroTable
from kbot.xacro.result import Expansion
from kbot.xacro.scope import Scope


@dataclass(frozen=True, slots=True)
class Definition:
    """A property, block or macro at the top level of a description or of a namespace."""

    kind: str
    name: str
    origin: Origin
    value: object = None

    @property
    def title(self) -> str:
        value = "" if self.value is None else f" = {self.value}"
        return f"{self.kind} '{self.name}'{value}"


def definitions(expansion: Expansion, name: str | None = None) -> list[Definition]:
    """All definitions at the top level and in namespaces, or those with one name."""
    found: list[Definition] = []
    if expansion.scope is not None:
        found += _properties(expansion.scope, "")
    if expansion.macros is not None:
        found += _macros(expansion.macros, "")
    return [definition for definition in found if name in (None, definition.name)]


def _properties(scope: Scope, prefix: str) -> Iterator[Definition]:
    for name, binding in scope.values.items():
        origin = binding.origin
        if isinstance(binding.value, Scope):
            yield from _properties(binding.value, f"{prefix}{name}.")
        elif origin is not None and name.startswith("*"):
            yield Definition("block", prefix + name.lstrip("*"), origin)
        elif origin is not None:
            yield Definition("property", prefix + name, origin, binding.value)


def _macros(table: MacroTable, prefix: str) -> Iterator[Definition]:
    for name, entry in table.own.items():
        if isinstance(entry, Macro):
            yield Definition("macro", prefix + name, Origin(entry.body.origin.span, entry.call))
        else:
            yield from _macros(entry, f"{prefix}{name}.")
