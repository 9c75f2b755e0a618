"""Raises Python's recursion limit for deep structures. All threads share it."""

from __future__ import annotations

import sys
from _thread import allocate_lock  # same as `threading.Lock`, but `threading` is slow to import
from contextlib import contextmanager

TYPE_CHECKING = False
if TYPE_CHECKING:
    from collections.abc import Iterator

_lock = allocate_lock()
_wanted: list[int] = []
_before = 0


@contextmanager
def recursion_limit(calls: int) -> Iterator[None]:
    """Allow `calls` nested calls within the block. The old limit returns when no thread needs more."""
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
