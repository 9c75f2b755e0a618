"""The process of a worker: it calls the functions that arrive on stdin, and answers on stdout.

A request is the size of a pickled `Request` in eight bytes, and then the request. An answer is a pickled
`Answer`.
"""

from __future__ import annotations

import os
import pickle
import queue
import sys
import threading
import time
import traceback
from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass
from typing import IO, Any

from kbot.text import KbotError
from kbot.text.recursion import recursion_limit

STACK_BYTES = 256 * 1024 * 1024
"""Stack of the thread that works. Only what is used takes memory."""
MOST_CALLS = 100_000
"""Nested calls, above those that the limits of descriptions allow. Pickling nests several per element."""


Answer = tuple[Any, Exception | None, float]
"""The result, the exception that was raised instead, and the processor time in s of the process so far."""


@dataclass(frozen=True, slots=True)
class Surroundings:
    """The working directory, empty if it was deleted, and the environment of the process that asks."""

    folder: str
    environment: dict[str, str]

    @classmethod
    def of_this_process(cls) -> Surroundings:
        folder = ""
        with suppress(FileNotFoundError):
            folder = os.getcwd()  # noqa: PTH109 - pathlib would only wrap it
        return cls(folder, dict(os.environ))


@dataclass(frozen=True, slots=True)
class Request:
    """A function to call, and where."""

    surroundings: Surroundings
    work: Callable[..., Any]
    arguments: tuple[Any, ...]


def main() -> None:
    """Answer requests until stdin ends, also if the work at that time never does."""
    requests, answers = os.fdopen(os.dup(0), "rb"), os.fdopen(os.dup(1), "wb")
    # what libraries and other processes print is not an answer, and what they read is not a request
    os.dup2(os.open(os.devnull, os.O_RDONLY), 0)
    os.dup2(2, 1)
    sys.stdout = sys.stderr
    waiting: queue.SimpleQueue[bytes] = queue.SimpleQueue()
    threading.stack_size(STACK_BYTES)
    threading.Thread(target=_work, args=(waiting, answers), daemon=True).start()
    while data := _read(requests):
        waiting.put(data)
    os._exit(0)


def _read(stream: IO[bytes]) -> bytes:
    """Return the next request, or nothing at the end."""
    size = int.from_bytes(stream.read(8), "little")
    return stream.read(size)


def _work(waiting: queue.SimpleQueue[bytes], answers: IO[bytes]) -> None:
    own = os.getpid()
    with recursion_limit(MOST_CALLS):
        while True:
            answer = _answer(waiting.get())
            if os.getpid() != own:  # the work forked, and this is the copy: it would answer twice
                os._exit(0)
            answers.write(answer)
            answers.flush()


def _answer(data: bytes) -> bytes:
    try:
        request: Request = pickle.loads(data)  # from the process that started this one
        surroundings = request.surroundings
        if surroundings.folder:
            os.chdir(surroundings.folder)
        if os.environ != surroundings.environment:
            os.environ.clear()
            os.environ.update(surroundings.environment)
        return _pickled(request.work(*request.arguments), None)
    except BaseException as error:  # noqa: BLE001 - raised where the request came from
        return _failure(error)


def _failure(error: BaseException) -> bytes:
    """The answer for an error. One that cannot be copied to the other process is replaced by its text."""
    if not isinstance(error, KbotError):  # the traceback of an internal error would be lost
        error.add_note("".join(traceback.format_exception(error)))
    if isinstance(error, Exception):
        with suppress(Exception):
            data = _pickled(None, error)
            pickle.loads(data)
            return data
    if isinstance(error, KbotError):
        return _pickled(None, KbotError(str(error)))
    return _pickled(None, RuntimeError(f"{type(error).__name__}: {error}"))


def _pickled(result: object, error: Exception | None) -> bytes:
    answer: Answer = (result, error, time.process_time())
    return pickle.dumps(answer, pickle.HIGHEST_PROTOCOL)
