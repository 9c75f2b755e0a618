"""The messages of the last minutes, in bounded memory."""

from __future__ import annotations

import zlib
from bisect import bisect_right
from collections import deque
from collections.abc import Collection, Iterable, Iterator
from itertools import pairwise

Frame = str | bytes

NOTHING = b""
"""In place of a frame: its key told nothing any more."""
KEPT_SECONDS = 300.0
MOST_BYTES = 64_000_000
CHUNK_SECONDS = 1.0
CHUNK_BYTES = 1_000_000
BYTES_A_SECOND = 500_000.0
"""Of one key: large frames, as images are, are kept less often than they come."""


class _Chunk:
    """Frames of about a second, packed together once it is over."""

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
        """The last frame of each key until `at`."""
        count = bisect_right(self._times, at)
        last = {self._keys[index]: index for index in range(count)}
        return dict(zip(last, self._unpacked(last.values()), strict=True))

    def told(self, keys: Collection[str], after: float, until: float) -> list[tuple[float, str, Frame]]:
        """When, of what and what, in order."""
        low, high = bisect_right(self._times, after), bisect_right(self._times, until)
        which = [index for index in range(low, high) if self._keys[index] in keys]
        times, names = (self._times[i] for i in which), (self._keys[i] for i in which)
        return list(zip(times, names, self._unpacked(which), strict=True))

    def count(self, key: str, after: float, until: float) -> int:
        """How often a key was told of."""
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
    """Encoded messages by the moment they were told, each moment whole: the newest of every key until then.

    The timeline counts seconds of simulated time, and goes on where that is set to another by a reset. What
    is older than `KEPT_SECONDS`, or too much for `MOST_BYTES`, is forgotten.
    """

    def __init__(self) -> None:
        self._chunks: deque[_Chunk] = deque()
        self._before: dict[str, bytes | str] = {}
        """What was said last of keys that no chunk tells of any more."""
        self._not_before: dict[str, float] = {}
        self._time: float | None = None
        self.end = 0.0

    @property
    def start(self) -> float:
        return self._chunks[0].start if self._chunks else self.end

    @property
    def size(self) -> int:
        """Bytes held."""
        return sum(chunk.size for chunk in self._chunks) + sum(map(len, self._before.values()))

    def pass_to(self, time: float) -> float:
        """Simulated time, in s, is this now; where that is along the timeline."""
        if self._time is not None:
            self.end += max(0.0, time - self._time)
        self._time = time
        return self.end

    def set_clock(self) -> None:
        """Simulated time is about to be another, without having passed."""
        self._time = None

    def add_some(self, key: str, frame: Frame) -> None:
        """As `add`, but of what comes often and is large not everything."""
        if self.end >= self._not_before.get(key, 0.0):
            self._not_before[key] = self.end + len(frame) / BYTES_A_SECOND
            self.add(key, frame)

    def add(self, key: str, frame: Frame) -> None:
        """Keep what was told now."""
        last = self._chunks[-1] if self._chunks else None
        if last is None or self.end - last.start >= CHUNK_SECONDS or last.size >= CHUNK_BYTES:
            if last is not None:
                last.pack()
            self._chunks.append(_Chunk(self.end))
            self._forget()
        self._chunks[-1].add(self.end, key, frame)

    def end_of(self, key: str) -> None:
        """Nothing is told of a key from now on: what it told does not hold any more."""
        self._not_before.pop(key, None)
        self.add(key, NOTHING)

    def at(self, moment: float, keys: Iterable[str]) -> dict[str, Frame]:
        """What was told last of these keys until a moment; those of which nothing holds are left out."""
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
        """What was told of keys after a moment and until another, about a second at once; `NOTHING` where a
        key ended."""
        for chunk in tuple(self._chunks):
            if chunk.start > until:
                return
            yield chunk.told(keys, after, until)

    def count(self, key: str, after: float, until: float) -> int:
        """How often a key was told of in that time."""
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
