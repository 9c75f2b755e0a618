"""Errors of expansion, from where they occur to where they are reported.

A XacroError starts with a place in the text in which it occurred. The caller that knows the attribute of this
text gives it an origin. The run reports it once, and makes a Diagnostic of it at the end.
"""

from __future__ import annotations

TYPE_CHECKING = False
if TYPE_CHECKING:
    from kbot.text.diagnostic import Diagnostic, Fix, Related, Severity
    from kbot.text.span import Origin


class Problem:
    """An error or warning that was reported; further places that it shows at are added to it."""

    __slots__ = ("code", "fix", "hint", "message", "origin", "related", "severity")

    def __init__(self, code: str, severity: Severity, message: str, origin: Origin | None, hint: str) -> None:
        self.code = code
        self.severity = severity
        self.message = message
        self.origin = origin
        self.hint = hint
        self.fix: Fix | None = None
        self.related: dict[tuple[str, int, str], Related] = {}

    def also(self, message: str, origin: Origin) -> None:
        """Add a place, unless it is the problem's own or known already."""
        from kbot.text.diagnostic import Related  # lazy in this module: only for an error

        span = origin.span
        if self.origin is None or (span.source, span.start) != (
            self.origin.span.source,
            self.origin.span.start,
        ):
            self.related.setdefault((span.file, span.start, message), Related(message, origin))

    def diagnostic(self) -> Diagnostic:
        from kbot.text.diagnostic import Diagnostic

        related = tuple(self.related.values())
        return Diagnostic(self.code, self.severity, self.message, self.origin, self.hint, related, self.fix)


class XacroError(Exception):
    """Something is wrong with the description.

    part     characters from and to, within the text that is being evaluated
    origin   where that is, once it is known
    key      faults of the same key are one problem with several places
    problem  the problem that this is only a consequence of
    """

    def __init__(
        self,
        code: str,
        message: str,
        hint: str = "",
        *,
        origin: Origin | None = None,
        key: object = None,
        problem: Problem | None = None,
    ) -> None:
        super().__init__(message)
        self.code = code
        self.message = message
        self.hint = hint
        self.part: tuple[int, int] | None = None
        self.origin = origin
        self.key = key
        self.problem = problem
        self.near = False
        """Whether the name in question resembles one that there is."""
        self.missing_file = False


class LimitFault(XacroError):
    """A bound was reached: nothing more is expanded."""


def consequence(problem: Problem) -> XacroError:
    """A fault that is no news: it comes of a problem that is reported already."""
    return XacroError(problem.code, problem.message, problem=problem)
