"""The exceptions that KBot raises.

KbotError                what a user can cause: bad input, bad arguments, a port in use
└── DescriptionError     a description that cannot be used; carries every diagnostic of the run
"""

from __future__ import annotations

TYPE_CHECKING = False
if TYPE_CHECKING:
    from collections.abc import Iterable

    from kbot.text.diagnostic import Diagnostic


class KbotError(Exception):
    """Something a user can cause and mend; its text is one clear sentence."""


class DescriptionError(KbotError):
    """A description that cannot be used, with all its diagnostics."""

    def __init__(self, diagnostics: Iterable[Diagnostic]) -> None:
        self.diagnostics = tuple(diagnostics)
        super().__init__("\n".join(str(d) for d in self.diagnostics if d.is_error))
