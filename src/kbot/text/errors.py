"""The exceptions that KBot raises.

KbotError                what a user can cause: bad input, bad arguments, a port in use
└── DescriptionError     a description that cannot be used; carries every diagnostic of the run
"""

from __future__ import annotations

TYPE_CHECKING = False
if TYPE_CHECKING:
    import os
    from collections.abc import Iterable
    from types import TracebackType

    from kbot.text.diagnostic import Diagnostic

READING = "while reading "
"""How the note of `reading` begins."""


class KbotError(Exception):
    """An error that a user can cause and fix; its text is one clear sentence."""


class DescriptionError(KbotError):
    """A description that cannot be used, with its diagnostics: all of them, unless there are very many."""

    def __init__(self, diagnostics: Iterable[Diagnostic]) -> None:
        from kbot.text.diagnostic import bounded  # most runs of kbot raise none

        self.diagnostics = bounded(tuple(diagnostics))
        super().__init__("\n".join(str(d) for d in self.diagnostics if d.is_error))


class reading:
    """Within it, an unforeseen error gets a note that names the file; the innermost file comes first."""

    __slots__ = ("_file",)

    def __init__(self, file: str | os.PathLike[str]) -> None:
        self._file = file

    def __enter__(self) -> None:
        """Nothing is prepared: an expansion pays for this too."""

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        name = str(self._file)
        if name and isinstance(error, Exception) and not isinstance(error, (KbotError, OSError)):
            error.add_note(READING + (name if name.isprintable() else ascii(name)))
