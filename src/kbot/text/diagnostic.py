"""What KBot has to say about a text: one type for parse errors, findings, physics and launch errors."""

from __future__ import annotations

from dataclasses import dataclass
from enum import StrEnum

from kbot.text.span import Origin, Span


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
    """Edits that mend a finding; a safe fix never changes what the author meant."""

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
