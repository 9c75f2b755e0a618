"""Raises Python's recursion limit for deep structures. All threads share it."""

from __future__ import annotations

import sys
from _thread import allocate_lock  # what `threading.Lock` is; importing that costs more than this file
from contextlib import contextmanager

TYPE_CHECKING = False
if TYPE_CHECKING:
    from collections.abc import Iterator

_lock = allocate_lock()
_wanted: list[int] = []
_before = 0


@contextmanager
def room_for(calls: int) -> Iterator[None]:
    """Let functions call each other `calls` deep within; the limit of before stands again after the last
    thread that needs more."""
    global _before
    with _lock:
        if not _wanted:
            _before = sys.getrecursionlimit()
        _wanted.append(calls)
        sys.setrecursionlimit(max(_before, *_wanted))
    try:
        yield
    finally:
        with _lock:
            _wanted.remove(calls)
            if not _wanted:
                sys.setrecursionlimit(_before)
