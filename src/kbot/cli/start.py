"""Entry point of `kbot`. Runs a plain `kbot expand` at once, and leaves all other verbs to `kbot.cli.main`.

Build tools run `kbot expand` for every robot. Importing click takes longer than expanding most descriptions,
so the plain case does without it.
"""

from __future__ import annotations

import os
import sys
from io import TextIOWrapper

from kbot.text.signals import raise_discarded_interruptions

TYPE_CHECKING = False
if TYPE_CHECKING:
    from collections.abc import Sequence

    from kbot.xacro.result import Expansion


def main() -> None:
    """Run the command line and exit with its status. An internal error prints one line and exits with 2."""
    try:
        _main()
    except SystemExit as end:
        _end_threads(end.code if isinstance(end.code, int) else int(end.code is not None))
        raise
    # Rust extensions raise errors that do not derive from Exception.
    except BaseException as error:  # noqa: BLE001 - the last guard
        if _comes_from_ctrl_c(error):  # also while modules are still being imported
            sys.exit(130)
        from kbot.text.crash import report_internal_error  # imported lazily, for a fast start-up

        report_internal_error(error)
        sys.exit(2)


def _main() -> None:
    raise_discarded_interruptions()
    _reopen_closed_streams()
    _print_utf_8()
    _filter_terminals()
    words = sys.argv[1:]
    expanded = _expand_without_options(words[1:]) if words[:1] == ["expand"] else None
    if expanded is not None and _print_if_clean(*expanded):
        return
    from kbot.cli.main import main as full

    full(expanded=expanded)


def _end_threads(status: int) -> None:
    """End KBot now if a thread of the user's program still runs. Python would wait for it for ever."""
    import threading  # imported lazily, for a fast start-up
    from contextlib import suppress

    if any(not (each.daemon or each is threading.main_thread()) for each in threading.enumerate()):
        from kbot.text.temporary import remove_all

        for stream in (sys.stdout, sys.stderr):
            with suppress(OSError):  # a closed pipe
                stream.flush()
        remove_all()  # os._exit does not run it, unlike the end of Python
        os._exit(status)


def _comes_from_ctrl_c(error: BaseException) -> bool:
    """Whether an error is Ctrl-C, or an ImportError that Ctrl-C caused in a module of pybind11."""
    if not isinstance(error, (KeyboardInterrupt, ImportError)):
        return False
    cause: BaseException | None = error
    while cause is not None and not isinstance(cause, KeyboardInterrupt):
        cause = cause.__cause__ or cause.__context__
    return cause is not None


def _reopen_closed_streams() -> None:
    """Open the null device for each standard stream that the shell closed (`kbot check robot.urdf >&-`).

    Otherwise the next file that KBot opens would get the stream's number, and output would go into that file.
    """
    for name, mode in (("stdin", "r"), ("stdout", "w"), ("stderr", "w")):
        if getattr(sys, name) is None:
            null = open(os.devnull, mode, encoding="utf-8")  # noqa: PTH123, SIM115 - until the program ends
            setattr(sys, name, null)


def _print_utf_8() -> None:
    """Print UTF-8 in every locale: XML without a declared encoding is UTF-8, and so is JSON.

    A file name that is not valid UTF-8 is printed with escapes.
    """
    for stream in (sys.stdout, sys.stderr):
        if isinstance(stream, TextIOWrapper):
            stream.reconfigure(encoding="utf-8", errors="backslashreplace")


def _filter_terminals() -> None:
    """Let no name in a file or message control the terminal. Pipes and files get the exact text."""
    for name in ("stdout", "stderr"):
        stream = getattr(sys, name)
        if stream.isatty():
            from kbot.text.terminal import TerminalStream  # imported lazily, for a fast start-up

            setattr(sys, name, TerminalStream(stream))


def _expand_without_options(words: Sequence[str]) -> tuple[Expansion, list[str]] | None:
    """The expansion of `FILE [name:=value …]` and its notes.

    None if the words need the full command line, or if there is an error, which `kbot.cli.expand` reports.
    """
    files = [word for word in words if ":=" not in word]
    if len(files) != 1 or files[0] == "kbot" or "=" in files[0] or files[0].startswith(("-", "/dev/")):
        return None  # kbot.cli.expand handles these; a pipe can be read only once
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


def _print_if_clean(expansion: Expansion, notes: Sequence[str]) -> bool:
    """Print an expansion that has nothing to report. Returns False if `kbot.cli.expand` has to take over."""
    if not expansion.ok or expansion.diagnostics or notes or sys.platform == "win32":
        return False
    try:
        sys.stdout.write(expansion.text)
        sys.stdout.flush()
    except OSError:
        return False
    return True
