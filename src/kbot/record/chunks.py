"""Caches the messages of a recording's chunks, and merges chunks by time."""

from __future__ import annotations

import heapq
from collections import OrderedDict
from collections.abc import Callable, Iterable, Iterator

from kbot.record.entry import RecordedMessage
from kbot.record.limits import LARGEST_PIECE, RecordingTooLarge

_KEPT_CHUNKS = 8
"""Chunks in the cache. Few chunks overlap in time, and a reader that steps back and forth uses few of them.
Writers begin a new chunk after 1 to 4 MB, so 8 take up to 32 MB."""


class ChunkCache:
    """The messages of the most recently used chunks, sorted by time."""

    def __init__(self) -> None:
        self._kept: OrderedDict[int, tuple[int, list[RecordedMessage]]] = OrderedDict()

    def entries(self, place: int, read: Callable[[], Iterable[RecordedMessage]]) -> list[RecordedMessage]:
        """The messages of the chunk at a place. `read` reads them if they are not cached."""
        if place in self._kept:
            self._kept.move_to_end(place)
            return self._kept[place][1]
        found = sorted(read(), key=lambda entry: entry.nanoseconds)
        self._kept[place] = sum(len(entry.data) for entry in found), found
        while len(self._kept) > 1 and (len(self._kept) > _KEPT_CHUNKS or self._size > LARGEST_PIECE):
            self._kept.popitem(last=False)
        return found

    def clear(self) -> None:
        self._kept.clear()

    @property
    def _size(self) -> int:
        return sum(size for size, _ in self._kept.values())


def in_time_order(chunks: Iterable[tuple[int, Iterable[RecordedMessage]]]) -> Iterator[RecordedMessage]:
    """Merge the messages of chunks by time. Chunks are given with their first times and sorted by them.

    Raises:
        RecordingTooLarge: so many chunks overlap in time that their messages do not fit in memory.
    """
    waiting: list[tuple[int, int, RecordedMessage]] = []
    held = count = 0
    for start, entries in chunks:
        while waiting and waiting[0][0] <= start:
            entry = heapq.heappop(waiting)[2]
            held -= len(entry.data)
            yield entry
        for entry in entries:
            count += 1
            held += len(entry.data)
            heapq.heappush(waiting, (entry.nanoseconds, count, entry))
        if held > LARGEST_PIECE:
            raise RecordingTooLarge(f"its chunks overlap in time by more than {LARGEST_PIECE:,} bytes")
    while waiting:
        yield heapq.heappop(waiting)[2]
