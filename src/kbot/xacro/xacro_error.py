"""Errors of expansion, from where they occur to where they are reported.

A XacroError is raised with a position in the text being evaluated. The caller that knows the text's attribute
adds the origin. The run reports the error once, and converts it to a Diagnostic at the end.
"""

from __future__ import annotations

TYPE_CHECKING = False
if TYPE_CHECKING:
    from kbot.text.diagnostic import Diagnostic, Fix, Related, Severity
    from kbot.text.span import Origin


class Problem:
    """A reported error or warning. Further places where it occurs are added to it."""

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
        """Add a related place, unless it is the problem's own place or already known."""
        from kbot.text.diagnostic import Related  # imported lazily: only an error needs it

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
    """An error in the description.

    part     start and end within the text being evaluated
    origin   the place in the file, once it is known
    key      faults with the same key are one problem with several places
    problem  the reported problem that caused this one
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
        self.fix: Fix | None = None
        self.is_elsewhere = False
        """Whether the origin is the cause, and not the text being evaluated, which needs it."""
        self.near = False
        """Whether the unknown name resembles an existing one."""


class LimitFault(XacroError):
    """A limit is exceeded. Expansion stops."""


def consequence(problem: Problem) -> XacroError:
    """A fault that a reported problem caused. It is not reported again."""
    return XacroError(problem.code, problem.message, problem=problem)
