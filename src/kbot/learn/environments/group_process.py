"""A group of environments in a process of its own.

Two threads would be slower than one, because Python's lock passes between them at every control period. A
process is started as `kbot.worker` starts its own, because the libraries for this would import the user's
main module again. It lives as long as its stdin is open.
"""

from __future__ import annotations

import json
import os
import pickle
import subprocess
import sys
import warnings
from contextlib import suppress
from typing import IO, Any
from weakref import finalize

from kbot.learn.environments.group import Group
from kbot.learn.interface.policy_interface import PolicyInterface
from kbot.text import KbotError

_START = (
    "import json, sys; sys.path[:] = json.loads(sys.argv[1]);"
    " from kbot.learn.environments.group_process import main; main()"
)
_ENDED = "a process of the vector environment ended: see what it printed, and create the environment again"


class GroupProcess:
    """The methods of a `Group`, in two parts: `send` returns at once, and `receive` waits for the result."""

    def __init__(self, *arguments: object) -> None:
        """`arguments` are those of `Group`. `receive` returns its interface, or raises what it raised."""
        self._process = subprocess.Popen(
            [sys.executable, "-P", "-c", _START, json.dumps([folder for folder in sys.path if folder])],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            start_new_session=True,  # Ctrl-C in the terminal is for the process that trains
            creationflags=getattr(subprocess, "CREATE_NEW_PROCESS_GROUP", 0),  # the same on Windows
        )
        self._end = finalize(self, _end, self._process)
        """Also ends the process when nobody refers to the group: `Popen` keeps a running process and its
        pipes."""
        self.send("", *arguments)

    def send(self, method: str, *arguments: object) -> None:
        """Begin a call of a method."""
        stream = self._process.stdin
        try:
            if stream is None or stream.closed:
                raise KbotError(_ENDED)
            pickle.dump((method, arguments), stream, pickle.HIGHEST_PROTOCOL)
            stream.flush()
        except OSError:
            raise KbotError(_ENDED) from None

    def receive(self) -> Any:  # noqa: ANN401 - what the method returns
        """The result of the call that was sent, or its exception."""
        stream = self._process.stdout
        try:
            if stream is None or stream.closed:
                raise KbotError(_ENDED)
            result, error = pickle.load(stream)  # from KBot's own code
        except (EOFError, OSError, pickle.UnpicklingError):
            raise KbotError(_ENDED) from None
        if error is not None:
            raise error
        return result

    def close(self) -> None:
        """End the process, also in the middle of a call."""
        self._end()


def _end(process: subprocess.Popen[bytes]) -> None:
    process.kill()
    process.wait()
    for stream in (process.stdin, process.stdout):
        if stream is not None:
            with suppress(OSError):  # what was not sent yet
                stream.close()


def main() -> None:
    """Answer calls until stdin ends."""
    calls, answers = os.fdopen(os.dup(0), "rb"), os.fdopen(os.dup(1), "wb")
    # what libraries print is not an answer, and what they read is not a call
    os.dup2(os.open(os.devnull, os.O_RDONLY), 0)
    os.dup2(2, 1)
    sys.stdout = sys.stderr
    warnings.simplefilter("ignore")  # the first group, in the user's process, has the same ones
    group: Group | None = None
    with suppress(EOFError, BrokenPipeError):
        while True:
            method, arguments = pickle.load(calls)  # from the process that started this one
            result: Any = None
            error: Exception | None = None
            try:
                if group is None or not method:
                    group = Group(*arguments)
                    result = group.interface
                else:
                    result = getattr(group, method)(*arguments)
            except Exception as raised:  # noqa: BLE001 - raised where the call came from
                error = raised if isinstance(raised, KbotError) else RuntimeError(f"{raised!r}")
            _answer(answers, result, error)


def _answer(stream: IO[bytes], result: object, error: Exception | None) -> None:
    pickle.dump((result, error), stream, pickle.HIGHEST_PROTOCOL)
    stream.flush()


class LocalGroup:
    """A group in this process, with the methods of a `GroupProcess`."""

    def __init__(self, *arguments: Any) -> None:  # noqa: ANN401 - those of a Group
        self.group = Group(*arguments)
        self._call: tuple[str, tuple[Any, ...]] = ("", ())

    def send(self, method: str, *arguments: object) -> None:
        self._call = method, arguments

    def receive(self) -> Any:  # noqa: ANN401 - what the method returns
        method, arguments = self._call
        return getattr(self.group, method)(*arguments) if method else self.interface

    @property
    def interface(self) -> PolicyInterface:
        return self.group.interface

    def close(self) -> None:
        """Do nothing: this group runs in the caller's process."""
