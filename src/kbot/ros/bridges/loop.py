"""The event loop of all bridges of a process, on one thread."""

from __future__ import annotations

import asyncio
import logging
import threading
from collections.abc import Callable, Coroutine
from functools import cache
from typing import Any, Generic, TypeVar

from kbot.text.complaints import Complaints

T = TypeVar("T")
S = TypeVar("S")
WAIT_SECONDS = 10.0

FAULTS = Complaints(logging.getLogger(__name__))
"""Where the bridges report what they did not foresee."""


@cache
def loop() -> asyncio.AbstractEventLoop:
    """It runs until the process ends. What is called on it must not wait, for all bridges would."""
    made = asyncio.new_event_loop()
    made.set_exception_handler(FAULTS.loop_fault)
    threading.Thread(target=made.run_forever, daemon=True, name="kbot-bridges").start()
    return made


def later(work: Callable[[], object]) -> None:
    """Do something on the loop; from any thread."""
    loop().call_soon_threadsafe(work)


def wait_for(work: Coroutine[Any, Any, T]) -> T:  # Any: what a coroutine takes and yields is of no interest
    """The result of what is run on the loop; from any other thread."""
    return asyncio.run_coroutine_threadsafe(work, loop()).result(WAIT_SECONDS)


class Batch(Generic[S]):
    """Collects what is said at one moment, and hands it on together: systems and libraries take many small
    things at once for little more than one."""

    def __init__(self, send: Callable[[list[S]], None]) -> None:
        self._send = send
        self._items: list[S] = []

    def add(self, item: S) -> None:
        self._items.append(item)

    def flush(self) -> None:
        if self._items:
            items, self._items = self._items, []
            self._send(items)
