"""Simulated time, and timers that run on it."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from heapq import heapify, heappop, heappush, heapreplace

from kbot.brief import Brief, counted
from kbot.messages.types import Time
from kbot.text import KbotError

NANOSECONDS = 1_000_000_000
NEVER = 1 << 62
"""`next_due` without timers: 146 years, later than any run."""


@dataclass(slots=True, repr=False)
class Timer(Brief):
    """Calls `callback` every `period` nanoseconds, first at `due`."""

    period: int
    due: int
    callback: Callable[[], None]
    cancelled: bool = False

    def cancel(self) -> None:
        self.cancelled = True

    def _shown(self) -> Iterator[str]:
        yield f"every {self.period / NANOSECONDS:g} s"
        yield "cancelled" if self.cancelled else f"next at {self.due / NANOSECONDS:g} s"


class Clock(Brief):
    """Time since the start in whole nanoseconds. Its owner, for example a simulation, advances it.

    Timers that are due at the same time are called in the order of their creation. Therefore two runs with
    the same inputs are identical.
    """

    def __init__(self) -> None:
        self._now = 0
        self._timers: list[tuple[int, int, Timer]] = []
        """A heap, sorted by due time and then by number."""
        self._last_number = 0
        self._after_timers: list[Callable[[], None]] = []
        self.next_due: int = NEVER
        """The time in nanoseconds at which the next timer is due, or NEVER."""

    @property
    def nanoseconds(self) -> int:
        return self._now

    @property
    def seconds(self) -> float:
        return self._now / NANOSECONDS

    @property
    def stamp(self) -> Time:
        return Time.from_nanoseconds(self._now)

    def every(self, rate: float, callback: Callable[[], None], *, start: int | None = None) -> Timer:
        """Call `callback` at `rate` (Hz of simulated time), first after one period.

        With `start` (nanoseconds), first at the first multiple of the period from then on. So the times of
        the calls do not depend on when the timer was made.

        Raises:
            KbotError: the rate is not a number above zero.
        """
        if not NANOSECONDS / NEVER < rate <= NANOSECONDS:
            raise KbotError(f"the rate must be a number above 0 Hz, not {rate}")
        period = max(1, round(NANOSECONDS / rate))
        due = self._now + period if start is None else -(-start // period) * period
        timer = Timer(period, due, callback)
        self._last_number += 1
        heappush(self._timers, (timer.due, self._last_number, timer))
        self.next_due = self._timers[0][0]
        return timer

    def after_timers(self, callback: Callable[[], None]) -> None:
        """Call `callback` once, at the next `advance_to`, after the timers that are due then."""
        self._after_timers.append(callback)

    def advance_to(self, nanoseconds: int) -> None:
        """Set the time and call each due timer once for every period that passed, then `after_timers`."""
        self.run_timers(nanoseconds)
        if self._after_timers:
            callbacks, self._after_timers = self._after_timers, []
            for callback in callbacks:
                callback()

    def run_timers(self, nanoseconds: int) -> None:
        """Set the time and call the due timers. `advance_to` must follow with the same time.

        Between the two, the caller can publish more messages with this time.
        """
        self._now = nanoseconds
        while self.next_due <= self._now:  # a callback may set either
            due, number, timer = self._timers[0]
            if timer.cancelled:
                heappop(self._timers)
            else:
                timer.due = due + timer.period
                heapreplace(self._timers, (timer.due, number, timer))
            self._update_next_due()  # before the callback, because it may raise
            if not timer.cancelled:
                timer.callback()

    def set(self, nanoseconds: int) -> None:
        """Jump to a time without calling timers. Each timer is next due at a multiple of its period."""
        self._now = nanoseconds
        for _, _, timer in self._timers:
            timer.due = (nanoseconds // timer.period + 1) * timer.period
        self._timers = [(timer.due, number, timer) for _, number, timer in self._timers]
        heapify(self._timers)
        self._update_next_due()

    def _update_next_due(self) -> None:
        self.next_due = self._timers[0][0] if self._timers else NEVER

    def _shown(self) -> Iterator[str]:
        yield f"{self.seconds:g} s"
        yield counted(len(self._timers), "timer")
