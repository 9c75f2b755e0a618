"""Simulated time, and what is called when it passes."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

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
        self._timers: list[Timer] = []
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
        if not 0.0 < rate <= NANOSECONDS:
            raise KbotError(f"a rate is a number of calls a second above zero, not {rate}")
        period = max(1, round(NANOSECONDS / rate))
        timer = Timer(period, self._now + period, callback)
        self._timers.append(timer)
        self.next_due = min(self.next_due, timer.due)
        return timer

    def afterwards(self, callback: Callable[[], None]) -> None:
        """Call back once, when time moves on next and all that was due has been called."""
        self._afterwards.append(callback)

    def advance_to(self, nanoseconds: int) -> None:
        """Move time on and call the timers that are due, each as often as its period passed."""
        self._now = nanoseconds
        while self.next_due <= nanoseconds:
            timer = min(self._timers, key=lambda t: t.due)
            timer.due += timer.period
            if not timer.cancelled:
                timer.callback()
            self._timers = [t for t in self._timers if not t.cancelled]
            self._find_next()
        if self._afterwards:
            afterwards, self._afterwards = self._afterwards, []
            for callback in afterwards:
                callback()

    def set(self, nanoseconds: int) -> None:
        """Jump to a time without calling anyone; each timer's next call is its next whole period."""
        self._now = nanoseconds
        for timer in self._timers:
            timer.due = (nanoseconds // timer.period + 1) * timer.period
        self._find_next()

    def _find_next(self) -> None:
        self.next_due = min((timer.due for timer in self._timers), default=NEVER)
