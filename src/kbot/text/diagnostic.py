"""The Diagnostic: the one type for parse errors, findings, and errors of physics and launch files."""

from __future__ import annotations

from dataclasses import dataclass
from enum import StrEnum

from kbot.text.span import Origin, Span

TYPE_CHECKING = False
if TYPE_CHECKING:
    from collections.abc import Sequence

_MOST = 100_000
"""Size of all diagnostics of a file, as `_size` counts it: 25,000 without macro calls. No real file has as
many. To print them as SARIF takes 3 s and 300 MB, a third of what a hostile file may take."""


class Severity(StrEnum):
    """How much a finding matters: an error is refused, a warning misbehaves, info may be meant."""

    ERROR = "error"
    WARNING = "warning"
    INFO = "info"


@dataclass(frozen=True, slots=True)
class Edit:
    """Replace the text of a span."""

    span: Span
    replacement: str


@dataclass(frozen=True, slots=True)
class Fix:
    """Edits that fix a finding; a safe fix never changes what the author meant."""

    title: str
    edits: tuple[Edit, ...]
    safe: bool


@dataclass(frozen=True, slots=True)
class Related:
    """Another place a finding speaks of; with `is_told` its message says where that is, so that in a text it
    need not be said again."""

    message: str
    origin: Origin
    is_told: bool = False


@dataclass(frozen=True, slots=True)
class Diagnostic:
    """One finding: what is wrong, where it was written, and what to do.

    `code` is stable and never used again for something else. `origin` is None only where no text
    is involved. `hint` says what to do, in one sentence.
    """

    code: str
    severity: Severity
    message: str
    origin: Origin | None = None
    hint: str = ""
    related: tuple[Related, ...] = ()
    fix: Fix | None = None

    @property
    def is_error(self) -> bool:
        return self.severity is Severity.ERROR

    def __str__(self) -> str:
        where = f"{self.origin}: " if self.origin else ""
        return f"{where}{self.severity}: {self.message} [{self.code}]"


def bounded(diagnostics: Sequence[Diagnostic]) -> tuple[Diagnostic, ...]:
    """The diagnostics of a file in their order. If there are very many, errors are kept before others, and a
    last one, K004, counts those that are left out."""
    if sum(map(_size, diagnostics)) <= _MOST:
        return tuple(diagnostics)
    kept, size = list[int](), 0
    for index in sorted(range(len(diagnostics)), key=lambda index: not diagnostics[index].is_error):
        size += _size(diagnostics[index])
        if size > _MOST:
            break
        kept.append(index)
    message = f"{len(diagnostics) - len(kept)} more findings are not listed"
    more = Diagnostic("K004", Severity.WARNING, message, None, "fix the listed ones first")
    return (*(diagnostics[index] for index in sorted(kept)), more)


def _size(diagnostic: Diagnostic) -> int:
    """The number of its places, plus four for the finding itself: it takes as long to print as four places.
    K004 counts as nothing, so that an error that is raised again keeps it."""
    if diagnostic.code == "K004":
        return 0
    calls = len(diagnostic.origin.stack) if diagnostic.origin else 0
    return 4 + calls + len(diagnostic.related)
