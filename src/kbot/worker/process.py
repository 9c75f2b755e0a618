"""What all processes of KBot that answer calls have in common: their start and their pipes."""

from __future__ import annotations

import json
import os
import pickle
import sys
import traceback
from contextlib import suppress
from typing import IO

from kbot.text import KbotError
from kbot.worker import children
from kbot.worker.children import PIPE, Child

_START = "import json, sys; sys.path[:] = json.loads(sys.argv[1]); from {} import main; main()"
"""Modules are found as in this process, and never in the working directory, which may be a stranger's."""


def start(module: str) -> Child:
    """A process that calls `main` of a module, with pipes for calls and answers.

    The libraries for this import the user's main module in the new process, which would run the user's
    program a second time.
    """
    folders = json.dumps([each for each in sys.path if each])
    command = [sys.executable, "-P", "-c", _START.format(module), folders]
    return children.start(command, stdin=PIPE, stdout=PIPE)


def take_pipes() -> tuple[IO[bytes], IO[bytes]]:
    """The pipes of calls and of answers, in the process that answers."""
    calls, answers = os.fdopen(os.dup(0), "rb"), os.fdopen(os.dup(1), "wb")
    # what libraries and other processes print is not an answer, and what they read is not a call
    os.dup2(os.open(os.devnull, os.O_RDONLY), 0)
    os.dup2(2, 1)
    sys.stdout = sys.stderr
    return calls, answers


def portable(error: BaseException) -> Exception:
    """The error, or one with its text if it cannot be copied to another process."""
    if not isinstance(error, KbotError):  # the traceback of an internal error would be lost
        error.add_note("".join(traceback.format_exception(error)))
    if isinstance(error, Exception):
        with suppress(Exception):
            pickle.loads(pickle.dumps(error, pickle.HIGHEST_PROTOCOL))
            return error
    if isinstance(error, KbotError):
        return KbotError(str(error))
    return RuntimeError(f"{type(error).__name__}: {error}")
