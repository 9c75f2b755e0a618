"""Collect the last log entries of a topic in one message, because pages receive only a topic's newest one."""

from __future__ import annotations

import itertools
from collections import deque
from dataclasses import dataclass

from kbot.messages.log import Log

MOST_LINES = 100
"""Entries of one message. If more lines are printed between two messages, the page misses the oldest."""
_RUNS = itertools.count()


@dataclass(frozen=True, slots=True)
class LogLines:
    """The last entries of a log. `first` is the number of the first of them, counted from 0. Each log has
    another `run`."""

    run: int
    first: int
    lines: tuple[Log, ...]


class LogTail:
    """The last entries of a topic."""

    def __init__(self) -> None:
        self._lines: deque[Log] = deque(maxlen=MOST_LINES)
        self._run, self._count = next(_RUNS), 0

    def take(self, entry: Log) -> None:
        self._lines.append(entry)
        self._count += 1

    def current(self) -> LogLines:
        return LogLines(self._run, self._count - len(self._lines), tuple(self._lines))
