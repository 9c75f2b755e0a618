"""Simulated time, and timers that it calls."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from heapq import heapify, heappop, heappush, heapreplace

from kbot.messages.types import Time
from kbot.text import KbotError

NANOSECONDS = 1_000_000_000
NEVER = 1 << 62


@dataclass(slots=True)
class Timer:
    """Calls back every `period` nanoseconds, first at `due`."""

    period: int
    due: int
    callback: Callable[[], None]
    cancelled: bool = False

    def cancel(self) -> None:
        self.cancelled = True


class Clock:
    """Time since the start in whole nanoseconds. Its owner, a simulation, moves it on.

    Timers that are due at the same moment are called in the order they were made, so that a run
    is the same every time.
    """

    def __init__(self) -> None:
        self._now = 0
        self._timers: list[tuple[int, int, Timer]] = []
        """A heap by when each is due and which was made first."""
        self._made = 0
        self._afterwards: list[Callable[[], None]] = []
        self.next_due: int = NEVER
        """Nanoseconds at which the next timer is due, NEVER when there is none."""

    @property
    def nanoseconds(self) -> int:
        return self._now

    @property
    def seconds(self) -> float:
        return self._now / NANOSECONDS

    @property
    def stamp(self) -> Time:
        return Time.from_nanoseconds(self._now)

    def every(self, rate: float, callback: Callable[[], None]) -> Timer:
        """Call back at `rate` (Hz) of simulated time, from the next period on.

        Raises:
            KbotError: the rate is not a number above zero.
        """
        if not NANOSECONDS / NEVER < rate <= NANOSECONDS:
            raise KbotError(f"a rate is a number of calls a second above zero, not {rate}")
        period = max(1, round(NANOSECONDS / rate))
        timer = Timer(period, self._now + period, callback)
        self._made += 1
        heappush(self._timers, (timer.due, self._made, timer))
        self.next_due = self._timers[0][0]
        return timer

    def afterwards(self, callback: Callable[[], None]) -> None:
        """Call back once, when time moves on next and all that was due has been called."""
        self._afterwards.append(callback)

    def advance_to(self, nanoseconds: int) -> None:
        """Move time on and call the timers that are due, each as often as its period passed, and then those
        that wait for the end of this moment."""
        self.begin_moment(nanoseconds)
        if self._afterwards:
            afterwards, self._afterwards = self._afterwards, []
            for callback in afterwards:
                callback()

    def begin_moment(self, nanoseconds: int) -> None:
        """As `advance_to`, where more is to be said at this moment, which that ends."""
        self._now = nanoseconds
        while self.next_due <= self._now:  # which a callback may set
            due, number, timer = self._timers[0]
            if timer.cancelled:
                heappop(self._timers)
            else:
                timer.due = due + timer.period
                heapreplace(self._timers, (timer.due, number, timer))
            self._find_next()  # before the callback, which may raise
            if not timer.cancelled:
                timer.callback()

    def set(self, nanoseconds: int) -> None:
        """Jump to a time without calling anyone; each timer's next call is its next whole period."""
        self._now = nanoseconds
        for _, _, timer in self._timers:
            timer.due = (nanoseconds // timer.period + 1) * timer.period
        self._timers = [(timer.due, number, timer) for _, number, timer in self._timers]
        heapify(self._timers)
        self._find_next()

    def _find_next(self) -> None:
        self.next_due = self._timers[0][0] if self._timers else NEVER
