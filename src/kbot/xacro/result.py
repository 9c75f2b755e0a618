"""The result of an expansion: document, text, source map and diagnostics."""

from __future__ import annotations

from functools import cached_property

from kbot.brief import Brief
from kbot.text.errors import DescriptionError
from kbot.text.xml import Element, Text, XmlDocument
from kbot.xacro.names import KNOWN
from kbot.xacro.serialise import banner, serialise

TYPE_CHECKING = False
if TYPE_CHECKING:
    from collections.abc import Mapping

    from kbot.text.diagnostic import Diagnostic
    from kbot.text.span import Call
    from kbot.xacro.binding import Binding
    from kbot.xacro.macros import MacroTable
    from kbot.xacro.scope import Scope
    from kbot.xacro.source_map import SourceMap  # rarely needed: start-up time
    from kbot.xacro.values import Value


class Expansion(Brief):
    """The result of expanding one description. Do not change it.

    document      the root element, or None if the file could not be read; after errors it contains what
                  could be expanded
    diagnostics   errors and warnings in the order of occurrence
    dependencies  every other file that was read, as it was named, in order
    steps         the work of the expansion, in steps of up to a microsecond
    """

    def __init__(
        self,
        path: str | None,
        source: XmlDocument | None,
        document: Element | None,
        diagnostics: tuple[Diagnostic, ...],
        dependencies: tuple[str, ...],
        scope: Scope | None = None,
        macros: MacroTable | None = None,
        defaults: Mapping[str, Binding] | None = None,
        declared: frozenset[str] = frozenset(),
        overridden: Mapping[str, Value] | None = None,
        steps: int = 0,
    ) -> None:
        self.path = path
        self.document = document
        self.diagnostics = diagnostics
        self.dependencies = dependencies
        self.steps = steps
        self.scope = scope
        """The names at the top level after the expansion."""
        self.macros = macros
        self.defaults: Mapping[str, Binding] = defaults or {}
        """The default of each argument, with its origin."""
        self.declared = declared
        """The names of the arguments."""
        self.overridden: Mapping[str, Value] = overridden or {}
        """The properties that the caller overrode, with the caller's values."""
        self._before: list[Text] = source.before if source else []
        self._after: list[Text] = source.after if source else []

    def __repr__(self) -> str:
        return f"Expansion({self.path!r}, {len(self.diagnostics)} diagnostics)"

    @property
    def ok(self) -> bool:
        """Whether there is a document and there are no errors."""
        return self.document is not None and not any(d.is_error for d in self.diagnostics)

    def require(self) -> Expansion:
        """Return this expansion.

        Raises:
            DescriptionError: there is an error. The exception has all diagnostics.
        """
        if not self.ok:
            raise DescriptionError(self.diagnostics)
        return self

    @cached_property
    def text(self) -> str:
        """The document as the `xacro` command writes it, with the banner. Empty without a document."""
        return self._serialised(with_banner=True)

    @cached_property
    def plain_text(self) -> str:
        """The document without the banner."""
        return self._serialised(with_banner=False)

    @cached_property
    def source_map(self) -> SourceMap:
        """Where every line, element and attribute of `text` was written."""
        from kbot.xacro.source_map import SourceMap  # imported lazily: few expansions need it

        return SourceMap(self.document, self.text)

    def names_at(self, call: Call | None) -> frozenset[str]:
        """The names that an expression can use in the macro of a call, or at the top level."""
        names = {*KNOWN, *(self.scope.known() if self.scope is not None else ())}
        if call is not None and call.kind == "macro" and self.macros is not None:
            macro = self.macros.find(call.name.removeprefix("xacro:"))
            names.update(parameter.name for parameter in getattr(macro, "parameters", ()))
        return frozenset(names)

    @property
    def nodes(self) -> list[Element | Text]:
        """The nodes of the document: those before the root element, the root, those after it."""
        return [*self._before, *([self.document] if self.document else []), *self._after]

    def _serialised(self, with_banner: bool) -> str:
        if self.document is None:
            return ""
        return serialise(self.nodes, banner(self.path) if with_banner and self.path is not None else "")
