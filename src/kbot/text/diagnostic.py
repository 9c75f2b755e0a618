"""Defines Diagnostic, the type of parse errors, findings, and errors of physics and launch files."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from enum import StrEnum

from kbot.brief import Brief, brief
from kbot.text.span import Origin, Span

TYPE_CHECKING = False
if TYPE_CHECKING:
    from collections.abc import Iterable, Sequence

_MOST = 100_000
"""Size of all diagnostics of a file, as `_size` counts it. It allows 25,000 diagnostics without macro calls,
more than any real file has. Printing them as SARIF takes 3 s and 300 MB, a third of what a hostile file may
take."""


ROS_PREFIX = "on ROS: "
"""Begins the message of an error that ROS would raise, although KBot accepts the file."""


class Severity(StrEnum):
    """How serious a finding is: an error is rejected, a warning misbehaves, an info may be intended."""

    ERROR = "error"
    WARNING = "warning"
    INFO = "info"


@dataclass(frozen=True, slots=True, repr=False)
class Edit(Brief):
    """A change of a source: it replaces the text of a span."""

    span: Span
    replacement: str


@dataclass(frozen=True, slots=True, repr=False)
class Fix(Brief):
    """Edits that fix a finding. A safe fix never changes what the author meant."""

    title: str
    edits: tuple[Edit, ...]
    safe: bool


@dataclass(frozen=True, slots=True, repr=False)
class Related(Brief):
    """Another place that a finding refers to.

    `is_in_message`: the finding's message already contains or counts this place, so that the text output
    omits it.
    """

    message: str
    origin: Origin
    is_in_message: bool = False


@dataclass(frozen=True, slots=True, repr=False)
class Diagnostic(Brief):
    """One finding: what is wrong, where it is, and what to do.

    `code` is stable and never reused for something else. `origin` is None only if no text is involved. `hint`
    is one sentence about what to do. `one_per_cause` merges the diagnostics of a code that have the same
    `cause`. It never merges those with an empty one.
    """

    code: str
    severity: Severity
    message: str
    origin: Origin | None = None
    hint: str = ""
    related: tuple[Related, ...] = ()
    fix: Fix | None = None
    cause: str = ""

    @property
    def is_error(self) -> bool:
        return self.severity is Severity.ERROR

    def __str__(self) -> str:
        where = f"{self.origin}: " if self.origin else ""
        return f"{where}{self.severity}: {self.message} [{self.code}]"

    def _shown(self) -> Iterator[str]:
        yield repr(self.code)
        yield repr(str(self.severity))
        yield brief(self.message)
        if self.origin is not None:
            yield str(self.origin)


def one_per_cause(diagnostics: Iterable[Diagnostic]) -> tuple[Diagnostic, ...]:
    """The diagnostics, with those of one code and `cause` merged into one, in order.

    A world of 6000 plants whose model is missing has one fault, not 6000. The merged diagnostic is that of
    the first place in its file. Its message counts the places, and the others are related places.
    """
    groups: dict[object, list[Diagnostic]] = {}
    for number, diagnostic in enumerate(diagnostics):
        key = (diagnostic.code, diagnostic.severity, diagnostic.cause) if diagnostic.cause else number
        groups.setdefault(key, []).append(diagnostic)
    return tuple(_merged(group) for group in groups.values())


def _merged(group: list[Diagnostic]) -> Diagnostic:
    if len(group) == 1:
        return group[0]
    file = group[0].origin.span.file if group[0].origin else ""
    placed = [(d.origin.span.file != file, d.origin.span.start, n) for n, d in enumerate(group) if d.origin]
    (_, _, index), *others = sorted(placed) or [(False, 0, 0)]
    first = group[index]
    origins = dict.fromkeys(group[n].origin for _, _, n in others)
    places = [Related("also here", o, is_in_message=True) for o in origins if o and o != first.origin]
    if not places:  # one place that is used several times, such as a line of a model
        return first
    message = f"{first.message} ({len(places) + 1} places)"
    fixes = [d.fix for d in group if d.fix]
    fix = first.fix
    if fix and all((other.title, other.safe) == (fix.title, fix.safe) for other in fixes):
        fix = replace(fix, edits=tuple(dict.fromkeys(edit for other in fixes for edit in other.edits)))
    return replace(first, message=message, related=(*first.related, *places), fix=fix)


def bounded(diagnostics: Sequence[Diagnostic]) -> tuple[Diagnostic, ...]:
    """The diagnostics of a file, in order.

    If there are too many, errors are kept first, and a final K004 counts the omitted ones.
    """
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
    """The number of places, plus four for the finding itself, which takes as long to print as four places.

    K004 has no size, so that it stays if the diagnostics are bounded again.
    """
    if diagnostic.code == "K004":
        return 0
    calls = len(diagnostic.origin.stack) if diagnostic.origin else 0
    return 4 + calls + len(diagnostic.related)
