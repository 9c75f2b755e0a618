"""The process of a worker: it calls the functions that arrive on stdin, and answers on stdout.

A request is the size of a pickled `Request` in eight bytes, and then the request. An answer is a pickled
`Answer`.
"""

from __future__ import annotations

import os
import pickle
import queue
import threading
import time
from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass
from typing import IO, Any

from kbot.text.recursion import recursion_limit
from kbot.worker.process import portable, take_pipes

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
    requests, answers = take_pipes()
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
        return _pickled(None, portable(error))


def _pickled(result: object, error: Exception | None) -> bytes:
    answer: Answer = (result, error, time.process_time())
    return pickle.dumps(answer, pickle.HIGHEST_PROTOCOL)
