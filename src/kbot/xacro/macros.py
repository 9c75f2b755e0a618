"""Macros: their parameters, and how a call finds one."""

from __future__ import annotations

import re

from kbot.text.span import Call
from kbot.text.xml import Element
from kbot.xacro.faults import Problem

TYPE_CHECKING = False
if TYPE_CHECKING:
    pass

_PARAMETER = re.compile(
    r"""\s*(?P<name>[^\s:=]+?)\s*:?=\s*
        (?P<forward>\^\|?)?
        (?P<default>\$\{.*?\}                           # an expression, blanks and all
                  | \$\(.*?\)                           # a command
                  | (?:'.*?' | ".*?" | [^\s'"]+)+       # words, with blanks where they are quoted
                  | )
        (?:\s+|$)(?P<rest>.*)""",
    re.VERBOSE,
)


class Parameter:
    """A parameter: `forwarded` takes the caller's value of the same name, `default` stands in."""

    __slots__ = ("default", "forwarded", "name")

    def __init__(self, name: str, forwarded: bool = False, default: str | None = None) -> None:
        self.name = name
        self.forwarded = forwarded
        self.default = default

    @property
    def is_block(self) -> bool:
        return self.name.startswith("*")

    @property
    def is_optional(self) -> bool:
        return self.forwarded or self.default is not None


class Macro:
    """A macro as it was last defined: its element, its parameters, and what brought it there.

    is_plain  whether its own attributes hold no expressions and no namespaces
    problem   what is wrong with the definition; calls are then no errors of their own
    """

    __slots__ = ("body", "call", "is_plain", "name", "parameters", "problem")

    def __init__(
        self,
        name: str,
        body: Element,
        parameters: tuple[Parameter, ...],
        call: Call | None = None,
        problem: Problem | None = None,
    ) -> None:
        self.name = name
        self.body = body
        self.parameters = parameters
        self.call = call
        self.is_plain = True
        self.problem = problem


class MacroTable:
    """Macros of one file, macro call or namespace, before those of the table around it."""

    __slots__ = ("own", "parent")

    def __init__(self, parent: MacroTable | None = None) -> None:
        self.parent = parent
        self.own: dict[str, Macro | MacroTable] = {}

    def find(self, name: str) -> Macro | MacroTable | None:
        table: MacroTable | None = self
        while table is not None:
            found = table.own.get(name)
            if found is not None:
                return found
            table = table.parent
        return None

    def names(self) -> list[str]:
        """The macros that can be called from here, those in namespaces with their prefix."""
        found: list[str] = []
        table: MacroTable | None = self
        while table is not None:
            for name, entry in table.own.items():
                if isinstance(entry, Macro):
                    found.append(name)
                else:
                    found += [f"{name}.{inner}" for inner in entry.names()]
            table = table.parent
        return found


def parse_parameters(text: str) -> tuple[Parameter, ...]:
    """The parameters of a macro's `params`: names, each with `:=` and a default or without.

    Raises:
        ValueError: nothing but blanks.
    """
    parameters = []
    while text:
        match = _PARAMETER.match(text)
        if match:
            parameter = Parameter(match["name"], match["forward"] is not None, match["default"] or None)
            text = match["rest"]
        else:
            words = text.split(None, 1)
            if not words:
                raise ValueError("params holds nothing but blanks")
            parameter, text = Parameter(words[0]), words[1] if len(words) > 1 else ""
        parameters.append(parameter)
    return tuple(parameters)
