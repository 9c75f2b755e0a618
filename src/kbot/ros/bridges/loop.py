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
"""Where the bridges report unforeseen errors."""


@cache
def loop() -> asyncio.AbstractEventLoop:
    """The loop, which runs until the process ends. Work on it must not block: all bridges share it."""
    made = asyncio.new_event_loop()
    made.set_exception_handler(FAULTS.loop_fault)
    threading.Thread(target=made.run_forever, daemon=True, name="kbot-bridges").start()
    return made


def later(work: Callable[[], object]) -> None:
    """Call a function on the loop. May be called on any thread."""
    loop().call_soon_threadsafe(work)


def wait_for(work: Coroutine[Any, Any, T]) -> T:  # Any: what the coroutine yields and receives
    """Run a coroutine on the loop and return its result. Must be called on another thread."""
    return asyncio.run_coroutine_threadsafe(work, loop()).result(WAIT_SECONDS)


class Batch(Generic[S]):
    """Collects items and sends them together, because one call with many small items is much faster."""

    def __init__(self, send: Callable[[list[S]], None]) -> None:
        self._send = send
        self._items: list[S] = []

    def add(self, item: S) -> None:
        self._items.append(item)

    def flush(self) -> None:
        if self._items:
            items, self._items = self._items, []
            self._send(items)
