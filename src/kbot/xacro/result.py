"""The result of an expansion: document, text, source map and diagnostics."""

from __future__ import annotations

from functools import cached_property

from kbot.text.errors import DescriptionError
from kbot.text.xml import Element, Text, XmlDocument
from kbot.xacro.serialise import banner, serialise

TYPE_CHECKING = False
if TYPE_CHECKING:
    from collections.abc import Mapping

    from kbot.text.diagnostic import Diagnostic
    from kbot.xacro.binding import Binding
    from kbot.xacro.macros import MacroTable
    from kbot.xacro.scope import Scope
    from kbot.xacro.source_map import SourceMap  # rarely needed: start-up time
    from kbot.xacro.values import Value


class Expansion:
    """The result of expanding one description. It is to be read, not changed.

    document      the root element, or None where the file could not be read at all; where there
                  are errors it holds what could be expanded
    diagnostics   errors and warnings in the order they were met
    dependencies  every file that was read on the way, as it was named, in order
    steps         the work that it took, in steps of up to a microsecond
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
        """The names of the top level as they were at the end."""
        self.macros = macros
        self.defaults: Mapping[str, Binding] = defaults or {}
        """Where the default of each argument is written."""
        self.declared = declared
        """The names of the arguments."""
        self.overridden: Mapping[str, Value] = overridden or {}
        """The properties whose value the caller overrode, with the caller's values."""
        self._before: list[Text] = source.before if source else []
        self._after: list[Text] = source.after if source else []

    def __repr__(self) -> str:
        return f"Expansion({self.path!r}, {len(self.diagnostics)} diagnostics)"

    @property
    def ok(self) -> bool:
        """Whether there is a document and no error."""
        return self.document is not None and not any(d.is_error for d in self.diagnostics)

    def require(self) -> Expansion:
        """This expansion, where it has no error.

        Raises:
            DescriptionError: with all diagnostics, where there is one.
        """
        if not self.ok:
            raise DescriptionError(self.diagnostics)
        return self

    @cached_property
    def text(self) -> str:
        """The document as the `xacro` command writes it, its banner included; empty without one."""
        return self._serialised(with_banner=True)

    @cached_property
    def plain_text(self) -> str:
        """The document without the banner."""
        return self._serialised(with_banner=False)

    @cached_property
    def source_map(self) -> SourceMap:
        """Where every line, element and attribute of `text` was written."""
        from kbot.xacro.source_map import SourceMap  # lazy in this module: few expansions need it

        return SourceMap(self.document, self.text)

    @property
    def nodes(self) -> list[Element | Text]:
        """The nodes of the document: those before the root element, the root, those after it."""
        return [*self._before, *([self.document] if self.document else []), *self._after]

    def _serialised(self, with_banner: bool) -> str:
        if self.document is None:
            return ""
        return serialise(self.nodes, banner(self.path) if with_banner and self.path is not None else "")
