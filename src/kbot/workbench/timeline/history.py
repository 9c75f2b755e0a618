"""The messages of the last minutes, in bounded memory."""

from __future__ import annotations

import zlib
from bisect import bisect_right
from collections import deque
from collections.abc import Collection, Iterable, Iterator
from itertools import pairwise

Frame = str | bytes

NOTHING = b""
"""Takes the place of a frame when its key has ended."""
KEPT_SECONDS = 300.0
"""Seconds of the timeline that are kept."""
MOST_BYTES = 64_000_000
"""Bytes that are kept."""
CHUNK_SECONDS = 1.0
"""A chunk is packed after this many seconds, or CHUNK_BYTES bytes."""
CHUNK_BYTES = 1_000_000
BYTES_A_SECOND = 500_000.0
"""Kept bytes per second of one key. Large frames such as images are kept less often than they arrive."""


class _Chunk:
    """The frames of about one second, compressed when it is over."""

    def __init__(self, start: float) -> None:
        self.start = start
        self.size = 0
        self.keys: set[str] = set()
        self._times: list[float] = []
        self._keys: list[str] = []
        self._frames: list[Frame] = []
        self._packed = b""
        self._ends: list[int] = []
        self._are_text: list[bool] = []

    def add(self, at: float, key: str, frame: Frame) -> None:
        self._times.append(at)
        self._keys.append(key)
        self._frames.append(frame)
        self.keys.add(key)
        self.size += len(frame)

    def pack(self) -> None:
        data = [frame.encode() if isinstance(frame, str) else frame for frame in self._frames]
        self._are_text = [isinstance(frame, str) for frame in self._frames]
        self._ends = [0]
        for part in data:
            self._ends.append(self._ends[-1] + len(part))
        self._packed = zlib.compress(b"".join(data), 1)
        self.size = len(self._packed)
        self._frames = []

    def newest(self, at: float) -> dict[str, Frame]:
        """Return the last frame of each key until `at`."""
        count = bisect_right(self._times, at)
        last = {self._keys[index]: index for index in range(count)}
        return dict(zip(last, self._unpacked(last.values()), strict=True))

    def frames_between(
        self, keys: Collection[str], after: float, until: float
    ) -> list[tuple[float, str, Frame]]:
        """Return time, key and frame in order."""
        low, high = bisect_right(self._times, after), bisect_right(self._times, until)
        which = [index for index in range(low, high) if self._keys[index] in keys]
        times, names = (self._times[i] for i in which), (self._keys[i] for i in which)
        return list(zip(times, names, self._unpacked(which), strict=True))

    def count(self, key: str, after: float, until: float) -> int:
        """Return the number of frames of a key."""
        low, high = bisect_right(self._times, after), bisect_right(self._times, until)
        return self._keys[low:high].count(key)

    def _unpacked(self, which: Collection[int]) -> list[Frame]:
        if self._frames or not which:
            return [self._frames[index] for index in which]
        data = zlib.decompress(self._packed)
        spans = list(pairwise(self._ends))
        parts = ((index, data[slice(*spans[index])]) for index in which)
        return [part.decode() if self._are_text[index] else part for index, part in parts]


class History:
    """Encoded messages by time. For each time, the newest message of every key is available.

    The timeline counts seconds of simulated time, and continues when a reset sets the clock. Messages older
    than `KEPT_SECONDS`, or beyond `MOST_BYTES`, are deleted.
    """

    def __init__(self) -> None:
        self._chunks: deque[_Chunk] = deque()
        self._before: dict[str, bytes | str] = {}
        """The last frames of keys that are in no chunk any more."""
        self._not_before: dict[str, float] = {}
        self._time: float | None = 0.0
        self.end = 0.0

    @property
    def start(self) -> float:
        return self._chunks[0].start if self._chunks else self.end

    @property
    def size(self) -> int:
        """Bytes held."""
        return sum(chunk.size for chunk in self._chunks) + sum(map(len, self._before.values()))

    def pass_to(self, time: float) -> float:
        """Set the current simulated time in s, and return the time on the timeline."""
        if self._time is not None:
            self.end += max(0.0, time - self._time)
        self._time = time
        return self.end

    def set_clock(self) -> None:
        """Announce that simulated time will jump without having passed."""
        self._time = None

    def add_some(self, key: str, frame: Frame) -> None:
        """Do the same as `add`, but skip frames of a key above BYTES_A_SECOND."""
        if self.end >= self._not_before.get(key, 0.0):
            self._not_before[key] = self.end + len(frame) / BYTES_A_SECOND
            self.add(key, frame)

    def add(self, key: str, frame: Frame) -> None:
        """Keep a frame of the current time."""
        last = self._chunks[-1] if self._chunks else None
        if last is None or self.end - last.start >= CHUNK_SECONDS or last.size >= CHUNK_BYTES:
            if last is not None:
                last.pack()
            self._chunks.append(_Chunk(self.end))
            self._forget()
        self._chunks[-1].add(self.end, key, frame)

    def end_of(self, key: str) -> None:
        """End a key: its last frame does not apply any more."""
        self._not_before.pop(key, None)
        self.add(key, NOTHING)

    def at(self, moment: float, keys: Iterable[str]) -> dict[str, Frame]:
        """Return the last frames of these keys until a time, without those that have ended."""
        return {key: frame for key, frame in self._newest(moment, keys).items() if frame != NOTHING}

    def _newest(self, moment: float, keys: Iterable[str]) -> dict[str, Frame]:
        wanted, found = set(keys), dict[str, Frame]()
        for chunk in reversed(self._chunks):
            if chunk.start <= moment and not chunk.keys.isdisjoint(wanted):
                newest = chunk.newest(moment)
                found.update({key: newest[key] for key in wanted & newest.keys()})
                wanted -= newest.keys()
            if not wanted:
                return found
        return {**found, **{key: self._before[key] for key in wanted & self._before.keys()}}

    def between(
        self, keys: Collection[str], after: float, until: float
    ) -> Iterator[list[tuple[float, str, Frame]]]:
        """Yield frames of keys after one time and until another, in lists of about a second. `NOTHING` marks
        the end of a key."""
        for chunk in tuple(self._chunks):
            if chunk.start > until:
                return
            yield chunk.frames_between(keys, after, until)

    def count(self, key: str, after: float, until: float) -> int:
        """Return the number of frames of a key in that time."""
        return sum(chunk.count(key, after, until) for chunk in self._chunks)

    @property
    def _is_long(self) -> bool:
        return self.end - self._chunks[1].start > KEPT_SECONDS

    def _forget(self) -> None:
        while len(self._chunks) > 1 and (self._is_long or self.size > MOST_BYTES):
            old = self._chunks.popleft()
            self._before.update(old.newest(self.end))
            for key in old.keys & self._chunks[0].keys:
                del self._before[key]
