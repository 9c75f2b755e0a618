"""A group of environments in a process of its own.

Two threads are slower than one: they contend for Python's lock in each control period. The process lives as
long as its stdin is open.
"""

from __future__ import annotations

import pickle
import warnings
from contextlib import suppress
from typing import Any
from weakref import finalize

from kbot.learn.environments.vector.group import Group
from kbot.learn.interface.policy_interface import PolicyInterface
from kbot.text import KbotError
from kbot.worker.process import portable, start, take_pipes

_ENDED = "a process of the vector environment ended. Its output has the reason. Create the environment again."


class GroupProcess:
    """The methods of a `Group`, in two parts: `send` returns at once, and `receive` waits for the result."""

    def __init__(self, *arguments: object) -> None:
        """`arguments` are those of `Group`. `receive` returns its interface, or raises what it raised."""
        self._process = start(__name__)
        self._end = finalize(self, self._process.end)
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


def main() -> None:
    """Answer calls until stdin ends."""
    calls, answers = take_pipes()
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
                error = portable(raised)
            pickle.dump((result, error), answers, pickle.HIGHEST_PROTOCOL)
            answers.flush()


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
