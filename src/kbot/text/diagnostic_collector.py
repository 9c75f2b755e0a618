"""Collects diagnostics, so that one run reports all of them."""

from __future__ import annotations

from collections.abc import Iterator

from kbot.brief import Brief, counted
from kbot.text.diagnostic import Diagnostic, Severity
from kbot.text.errors import DescriptionError
from kbot.text.span import Origin


class DiagnosticCollector(Brief):
    """Collects diagnostics in the list `diagnostics`."""

    def __init__(self) -> None:
        self.diagnostics: list[Diagnostic] = []

    def error(self, code: str, message: str, origin: Origin | None, hint: str = "", cause: str = "") -> None:
        self.diagnostics.append(Diagnostic(code, Severity.ERROR, message, origin, hint, cause=cause))

    def warning(
        self, code: str, message: str, origin: Origin | None, hint: str = "", cause: str = ""
    ) -> None:
        self.diagnostics.append(Diagnostic(code, Severity.WARNING, message, origin, hint, cause=cause))

    def info(self, code: str, message: str, origin: Origin | None, hint: str = "") -> None:
        self.diagnostics.append(Diagnostic(code, Severity.INFO, message, origin, hint))

    def require(self) -> None:
        """Raise DescriptionError with all diagnostics if one of them is an error."""
        if any(d.is_error for d in self.diagnostics):
            raise DescriptionError(self.diagnostics)

    def _shown(self) -> Iterator[str]:
        yield counted(len(self.diagnostics), "diagnostic")
