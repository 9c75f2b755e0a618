"""Detects changed files by their time, size and identity."""

from __future__ import annotations

import asyncio
import math
import os
from collections.abc import Iterable

POLL_SECONDS = 0.04

Signature = tuple[tuple[int, int, int] | None, ...]


class Watcher:
    """Waits for a change of any of its files; a file that is missing is watched too."""

    def __init__(self, files: Iterable[str], read: int) -> None:
        """They were read at `read`, a wall time in ns: what changed since then is news."""
        self._files: tuple[str, ...] = ()
        self._seen: Signature = ()
        self.watch(files, read)

    def watch(self, files: Iterable[str], read: int) -> None:
        """Watch these files instead. Those watched before keep what was seen of them."""
        known = dict(zip(self._files, self._seen, strict=True))
        self._files = tuple(files)
        self._seen = tuple(known[file] if file in known else _stamp(file, read) for file in self._files)

    async def changed(self) -> None:
        """Return once a file has changed and has then been still for one poll.

        An editor may write in pieces, or move a new file into place: a missing file is given a
        few polls to come back.
        """
        while (now := _signature(self._files)) == self._seen:
            await asyncio.sleep(POLL_SECONDS)
        for _ in range(8):
            await asyncio.sleep(POLL_SECONDS / 2)
            before, now = now, _signature(self._files)
            if before == now and not self._misses(now):
                break
        self._seen = now

    def _misses(self, now: Signature) -> bool:
        """Whether a file is gone that was there."""
        return any(there is None and was is not None for there, was in zip(now, self._seen, strict=True))


def _signature(files: tuple[str, ...]) -> Signature:
    return tuple(_stamp(file) for file in files)


def _stamp(file: str, until: float = math.inf) -> tuple[int, int, int] | None:
    """None where there is and can be no such file, or one that was changed after a wall time in ns."""
    try:
        status = os.stat(file)  # noqa: PTH116 - five times cheaper than Path.stat, and done often
    except (OSError, ValueError):  # a name that a file cannot have, as one with a null character
        return None
    if status.st_mtime_ns > until:
        return None
    return status.st_mtime_ns, status.st_size, status.st_ino
