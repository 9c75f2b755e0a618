"""The exceptions that KBot raises.

KbotError                errors that a user can cause: bad input, bad arguments, a port in use
└── DescriptionError     an unusable description, with all diagnostics of the run
"""

from __future__ import annotations

TYPE_CHECKING = False
if TYPE_CHECKING:
    import os
    from collections.abc import Iterable
    from types import TracebackType

    from kbot.text.diagnostic import Diagnostic

READING = "while reading "
"""The start of the note that `reading` adds."""


class KbotError(Exception):
    """An error that a user can cause and fix. Its text is one clear sentence."""


class DescriptionError(KbotError):
    """A description that cannot be used. `diagnostics` has all its diagnostics, unless there are too many."""

    def __init__(self, diagnostics: Iterable[Diagnostic]) -> None:
        from kbot.text.diagnostic import bounded  # only for an error: start-up time

        self.diagnostics = bounded(tuple(diagnostics))
        super().__init__("\n".join(str(d) for d in self.diagnostics if d.is_error))

    def __reduce__(self) -> tuple[type[DescriptionError], tuple[tuple[Diagnostic, ...]]]:
        """Return what a copy is made from in another process: the diagnostics, not the text."""
        return DescriptionError, (self.diagnostics,)


class reading:
    """A block in which an internal error gets a note that names the file. The innermost file is first."""

    __slots__ = ("_file",)

    def __init__(self, file: str | os.PathLike[str]) -> None:
        self._file = file

    def __enter__(self) -> None:
        """Does nothing, because each expansion would have to pay for it."""

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        name = str(self._file)
        if name and isinstance(error, Exception) and not isinstance(error, (KbotError, OSError)):
            error.add_note(READING + (name if name.isprintable() else ascii(name)))


class Stopped(BaseException):
    """Raised in a user's program to end it. Not an Exception: `except Exception` must not catch it."""
