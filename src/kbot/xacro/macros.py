"""Macros: their parameters, and the tables in which calls find them."""

from __future__ import annotations

import re

from kbot.text.span import Call
from kbot.text.xml import Element
from kbot.xacro.xacro_error import Problem

TYPE_CHECKING = False
if TYPE_CHECKING:
    from collections.abc import Iterator

_HEAD = re.compile(r"\s*(?P<name>[^\s:=]+)\s*:?=(?P<blank>\s*)")
_WORD = re.compile(r"[^\s'\"]+")
_BLANK = re.compile(r"\s*")
_FORWARDS = ("^|", "^", "")


class MacroParameter:
    """A parameter. If `forwarded`, it takes the caller's value of its name. Otherwise, `default` is used."""

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
    """A macro as it was last defined: its element, its parameters, and the call that led there.

    size      characters of the body
    is_plain  whether its own attributes contain neither expressions nor namespaces
    problem   the error in the definition; calls are then not reported as further errors
    """

    __slots__ = ("body", "call", "is_plain", "name", "parameters", "problem", "size")

    def __init__(
        self,
        name: str,
        body: Element,
        parameters: tuple[MacroParameter, ...],
        call: Call | None = None,
        problem: Problem | None = None,
    ) -> None:
        self.name = name
        self.body = body
        self.parameters = parameters
        self.call = call
        self.size = 0
        self.is_plain = True
        self.problem = problem


class MacroTable:
    """The macros of one file, macro call or namespace. They hide those of the enclosing table."""

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
        """The macros that can be called from here. Those in namespaces have a prefix."""
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


def parse_parameters(text: str) -> tuple[MacroParameter, ...]:
    """The parameters of a macro's `params`: names, with or without `:=` and a default.

    Raises:
        ValueError: the text contains only blanks.
    """
    parameters = []
    while text:
        found = parse_default(text)
        if found:
            parameter, text = found
        else:
            words = text.split(None, 1)
            if not words:
                raise ValueError("params contains only blanks")
            parameter, text = MacroParameter(words[0]), words[1] if len(words) > 1 else ""
        parameters.append(parameter)
    return tuple(parameters)


def parse_default(text: str) -> tuple[MacroParameter, str] | None:
    """The parameter with a default at the start of a text, and the rest of the text. None if there is none.

    The official implementation uses a regular expression that takes exponential time on unbalanced quotes.
    This function makes the same choices in the same order, but visits each position once.
    """
    head = _HEAD.match(text)
    if head is None:
        return None
    for start in range(head.end("blank"), head.start("blank") - 1, -1):
        for forward in _FORWARDS:
            if not text.startswith(forward, start):
                continue
            begin = start + len(forward)
            end = _default_end(text, begin)
            if end is not None:
                parameter = MacroParameter(head["name"], forward != "", text[begin:end] or None)
                blank = _BLANK.match(text, end)
                return parameter, text[blank.end() if blank else end :].partition("\n")[0]
    return None


def _default_end(text: str, begin: int) -> int | None:
    """The end of the default that begins here. It is followed by a blank or the end of the text."""
    line_end = text.find("\n", begin)
    line_end = len(text) if line_end < 0 else line_end
    for opening, closing in (("${", "}"), ("$(", ")")):  # one expression, which may contain blanks
        if text.startswith(opening, begin):
            at = text.find(closing, begin + 2, line_end)
            while at >= 0:
                if _ends(text, at + 1):
                    return at + 1
                at = text.find(closing, at + 1, line_end)
    end = _words_end(text, begin)
    return begin if end is None and _ends(text, begin) else end


def _words_end(text: str, begin: int) -> int | None:
    """The end of a row of words and quoted pieces. Quoted pieces may contain blanks and quotes."""
    visited: set[int] = set()
    pending = [iter(_next_ends(text, begin))]
    places = [begin]
    while pending:
        at = next(pending[-1], None)
        if at is None:
            pending.pop()
            here = places.pop()
            if pending and _ends(text, here):
                return here
        elif at not in visited:
            visited.add(at)
            places.append(at)
            pending.append(iter(_next_ends(text, at)))
    return None


def _next_ends(text: str, begin: int) -> Iterator[int]:
    """The possible ends of a piece that begins here, in the order in which to try them."""
    quote = text[begin : begin + 1]
    if quote in ("'", '"') and quote:
        line_end = text.find("\n", begin)
        line_end = len(text) if line_end < 0 else line_end
        at = text.find(quote, begin + 1, line_end)
        while at >= 0:
            yield at + 1
            at = text.find(quote, at + 1, line_end)
        return
    word = _WORD.match(text, begin)
    if word:
        yield word.end()


def _ends(text: str, at: int) -> bool:
    return at >= len(text) or text[at].isspace()
