"""Reports internal errors: one line for the user, and a crash file with the traceback."""

from __future__ import annotations

import os
import sys
from contextlib import suppress
from pathlib import Path

from kbot.text.errors import READING

TYPE_CHECKING = False
if TYPE_CHECKING:
    import threading

KEPT = 20
"""Crash files to keep, the newest ones. A program that fails every night must not fill the disk. The files
take about 20 MiB at most, because each has at most MOST_BYTES."""
MOST_BYTES = 1 << 20
"""Size of the longest traceback in a crash file. An error's message may quote a whole input."""


def internal_error(error: BaseException, during: str = "") -> str:
    """Write a crash file, and return the line that reports an internal error.

    If KBot continues afterwards, `during` names what failed, for example the type of a message.
    """
    where = f"{during} failed: " if during else ""
    file = next((note for note in getattr(error, "__notes__", ()) if note.startswith(READING)), "")
    head = f"{where}internal error {file}".rstrip() + f" ({type(error).__name__})"
    version = _version()
    try:
        path = _write(error, f"KBot {version}\n{head}\n")
    except Exception as failure:  # noqa: BLE001 - the line is reported even if nothing can be written
        reason = getattr(failure, "strerror", None) or type(failure).__name__
        return f"{head}; KBot {version} could not write a crash file: {reason}"
    return f"{head}; KBot {version} wrote a crash file, please report it: {path}"


def report_internal_error(error: BaseException, during: str = "") -> None:
    """Print that line to stderr. If KBOT_DEBUG is set, as in tests, print the traceback too.

    The crash file is written even if stderr is full or closed.
    """
    line = f"error: {internal_error(error, during)}\n"
    with suppress(OSError, ValueError):  # ValueError: the stream is closed
        if os.environ.get("KBOT_DEBUG"):
            import traceback  # imported lazily: only a crash needs it

            traceback.print_exception(error)
        sys.stderr.write(line)
        sys.stderr.flush()


def report_thread_error(failed: threading.ExceptHookArgs) -> None:
    """Report an error that ends a thread, for `threading.excepthook`. Other threads continue."""
    if failed.exc_value is not None and not issubclass(failed.exc_type, SystemExit):
        name = failed.thread.name if failed.thread is not None else "unknown"
        report_internal_error(failed.exc_value, f"thread {name}")


def state_folder() -> Path:
    """The folder for KBot's own state, such as crash files, by the platform's convention."""
    if sys.platform == "win32":
        local = os.environ.get("LOCALAPPDATA")
        return (Path(local) if local else Path.home() / "AppData" / "Local") / "kbot"
    if sys.platform == "darwin":
        return Path.home() / "Library" / "Application Support" / "kbot"
    # relative paths are ignored, as the specification requires: https://specifications.freedesktop.org/basedir-spec/
    given = os.environ.get("XDG_STATE_HOME", "")
    return (Path(given) if Path(given).is_absolute() else Path.home() / ".local" / "state") / "kbot"


def _write(error: BaseException, head: str) -> str:
    """Write a new crash file and delete the oldest ones. Raises OSError: the folder is not writable."""
    import platform
    import shlex
    import tempfile
    import time
    import traceback

    if isinstance(error, MemoryError):
        traceback.clear_frames(error.__traceback__)  # their local variables hold the memory that ran out
    now = time.gmtime()
    words = shlex.join(sys.argv)
    facts = (
        f"Python {sys.version} ({sys.executable})\n"
        f"{platform.platform()}\n{time.strftime('%Y-%m-%d %H:%M:%S', now)} UTC\n{words}\n\n"
    )
    text = "".join(traceback.format_exception(error))
    if len(text) > MOST_BYTES:
        text = text[: MOST_BYTES // 2] + "\n[...]\n" + text[-MOST_BYTES // 2 :]
    folder = state_folder() / "crashes"
    folder.mkdir(parents=True, exist_ok=True)
    # names sort by time, so that finding the oldest files needs no stat of each
    prefix = f"{time.strftime('%Y%m%d-%H%M%S', now)}-"
    descriptor, path = tempfile.mkstemp(prefix=prefix, suffix=".txt", dir=folder)  # noqa: TID251 - it stays
    with open(descriptor, "w", encoding="utf-8", errors="backslashreplace") as stream:
        stream.write(head + facts + text)
    for old in sorted(folder.glob("*.txt"))[:-KEPT]:
        old.unlink(missing_ok=True)
    return path


def _version() -> str:
    try:
        from importlib.metadata import version

        return version("kbot")
    except Exception:  # noqa: BLE001 - a source tree that is not installed has no version
        return "(unknown version)"
