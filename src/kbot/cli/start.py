"""Entry point of `kbot`. A plain `kbot expand` is done here at once; `kbot.cli.main` does the rest.

Build tools run `kbot expand` for every robot, and the command line's library takes longer to
import than a description takes to expand.
"""

from __future__ import annotations

import os
import sys
from io import TextIOWrapper

TYPE_CHECKING = False
if TYPE_CHECKING:
    from collections.abc import Sequence

    from kbot.xacro.result import Expansion


def main() -> None:
    """Run the command line and leave with its exit status; an unforeseen error is one line and status 2."""
    try:
        _main()
    except SystemExit:
        raise
    # Rust extensions raise errors that do not derive from Exception.
    except BaseException as error:  # noqa: BLE001 - the last guard
        if _comes_from_ctrl_c(error):  # also while modules are still being imported
            sys.exit(130)
        from kbot.text.crash import report_internal_error  # lazy in this module: start-up time

        report_internal_error(error)
        sys.exit(2)


def _main() -> None:
    _open_what_is_closed()
    _print_utf_8()
    words = sys.argv[1:]
    expanded = _expand_plainly(words[1:]) if words[:1] == ["expand"] else None
    if expanded is not None and _is_printed(*expanded):
        return
    from kbot.cli.main import main as full

    full(expanded=expanded)


def _comes_from_ctrl_c(error: BaseException) -> bool:
    """Whether an error is Ctrl-C, or an ImportError that Ctrl-C caused in a module of pybind11."""
    if not isinstance(error, (KeyboardInterrupt, ImportError)):
        return False
    cause: BaseException | None = error
    while cause is not None and not isinstance(cause, KeyboardInterrupt):
        cause = cause.__cause__ or cause.__context__
    return cause is not None


def _open_what_is_closed() -> None:
    """Where a shell closed a standard stream (`kbot check robot.urdf >&-`), take the null device for it, or
    the next file to be opened would be written to in its place."""
    for name, mode in (("stdin", "r"), ("stdout", "w"), ("stderr", "w")):
        if getattr(sys, name) is None:
            null = open(os.devnull, mode, encoding="utf-8")  # noqa: PTH123, SIM115 - until the program ends
            setattr(sys, name, null)


def _print_utf_8() -> None:
    """Print UTF-8 whatever the locale is: XML without a declared encoding is UTF-8, and so is JSON.

    What UTF-8 cannot express, as a file's name that is not UTF-8, is printed as an escape.
    """
    for stream in (sys.stdout, sys.stderr):
        if isinstance(stream, TextIOWrapper):
            stream.reconfigure(encoding="utf-8", errors="backslashreplace")


def _expand_plainly(words: Sequence[str]) -> tuple[Expansion, list[str]] | None:
    """The expansion of `FILE [name:=value …]` and its notes; None if there is more to do, or an error."""
    files = [word for word in words if ":=" not in word]
    if len(files) != 1 or files[0] == "kbot" or "=" in files[0] or files[0].startswith(("-", "/dev/")):
        return None  # what comes from a pipe can be read once only
    from kbot.cli.xacro_command import xacro_arguments
    from kbot.text.errors import KbotError
    from kbot.text.notes import notes_sent_to
    from kbot.xacro import expand

    notes: list[str] = []

    try:
        given = dict(word.split(":=", 1) for word in words if ":=" in word)
        with notes_sent_to(notes.append):
            return expand(files[0], xacro_arguments(given)), notes
    except KbotError:
        return None


def _is_printed(expansion: Expansion, notes: Sequence[str]) -> bool:
    """Print an expansion if there is nothing to report; `kbot.cli.expand` takes over any other."""
    if not expansion.ok or expansion.diagnostics or notes or sys.platform == "win32":
        return False
    try:
        sys.stdout.write(expansion.text)
        sys.stdout.flush()
    except OSError:
        return False
    return True
