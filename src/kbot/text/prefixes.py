"""Checks that the prefixes of names such as `xacro:macro` are declared."""

from __future__ import annotations

from kbot.text.span import Origin, Source, Span
from kbot.text.xml_nodes import Element, markup_end

TYPE_CHECKING = False
if TYPE_CHECKING:
    from kbot.text.diagnostic import Diagnostic

_XACRO_HINT = 'declare it in the root element: xmlns:xacro="http://www.ros.org/wiki/xacro"'


class Prefixes:
    """Checks the prefixes of names, and remembers the names that are correct."""

    def __init__(self, source: Source) -> None:
        self.source = source
        self.tags: set[str] = set()
        self.names: set[str] = set()
        self.problems: list[Diagnostic] = []
        self._refused: set[str] = set()

    def check(self, tag: str, attributes: dict[str, str], at: int, stack: list[Element]) -> None:
        for name in (tag, *attributes):
            known = ":" not in name
            if not known:
                prefix = name.partition(":")[0]
                known = prefix in ("xml", "xmlns")
            if not known:
                declaration = "xmlns:" + prefix
                known = declaration in (stack[0].attributes if stack else attributes)
                if not known and not any(declaration in e.attributes for e in stack):
                    self._refuse(prefix, declaration in attributes, at)
            if known:
                (self.tags if name is tag else self.names).add(name)

    def _refuse(self, prefix: str, declared_here: bool, at: int) -> None:
        if declared_here or prefix in self._refused:
            return
        self._refused.add(prefix)
        message = f"the prefix '{prefix}' is not declared"
        hint = _XACRO_HINT if prefix == "xacro" else f'declare it in the root element: xmlns:{prefix}="…"'
        end = markup_end(self.source.data, at)
        self.problems.append(fault(self.source, "P004", message, at, end, hint))


def fault(source: Source, code: str, message: str, start: int, end: int, hint: str) -> Diagnostic:
    """An error at a part of a source."""
    from kbot.text.diagnostic import Diagnostic, Severity  # only for an error: start-up time

    return Diagnostic(code, Severity.ERROR, message, Origin(Span(source, start, end)), hint)
