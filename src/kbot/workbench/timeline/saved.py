"""Saved states of a simulation over time, in bounded memory, for *Resume from here*."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

from kbot.text import KbotError
from kbot.workbench.timeline.history import KEPT_SECONDS

EVERY = 0.2
"""Seconds of the timeline between two saved states."""
ALL_FOR, THEN_EVERY = 60.0, 25
"""Seconds for which all states are kept. Of older ones every 25th is kept, one in 5 s."""
MOST_BYTES = 200_000_000
"""Bytes that are kept."""


@dataclass(frozen=True, slots=True)
class Saved:
    """A state saved `at` seconds on the timeline and at a simulated `time` in s; `size` in bytes."""

    number: int
    lap: int
    """Increases each time that the simulation is set back."""
    at: float
    time: float
    state: object
    size: int


class SavedStates:
    """The states of one run. The states of an earlier run cannot be resumed."""

    def __init__(self) -> None:
        self._all: list[Saved] = []
        self._count = 0
        self._run: object = None

    @property
    def size(self) -> int:
        """Bytes held, approximately."""
        return sum(saved.size for saved in self._all)

    def keep(
        self, at: float, time: float, run: object, take: Callable[[], tuple[object, int] | None]
    ) -> None:
        """Save a state if one is due. `take` returns it with its size, or None if there is none."""
        if run is not self._run:
            self._run, self._all = run, []
        is_anew = not self._all or time < self._all[-1].time
        if not is_anew and at - self._all[-1].at < EVERY:
            return
        taken = take()
        if taken is None:
            return
        lap = (self._all[-1].lap if self._all else 0) + is_anew
        self._all.append(Saved(self._count, lap, at, time, *taken))
        self._count += 1
        self._all = [saved for saved in self._all if _is_kept(saved, at - saved.at)]
        while self.size > MOST_BYTES and len(self._all) > 1:
            del self._all[0]

    def nearest(self, at: float, run: object) -> Saved:
        """Return the state to resume instead of a time. Raises KbotError if none is near."""
        known = self._all if run is self._run else []
        if not known:
            raise KbotError("no state of this robot and world is saved yet")
        if at < known[0].at - EVERY:
            raise KbotError(
                "no state of this robot and world is saved for that time. The first one is "
                f"{known[0].at - at:.1f} s later"
            )
        lap = max((saved.lap for saved in known if saved.at <= at), default=known[0].lap)
        return min((saved for saved in known if saved.lap == lap), key=lambda saved: abs(saved.at - at))


def _is_kept(saved: Saved, age: float) -> bool:
    return age <= ALL_FOR or (saved.number % THEN_EVERY == 0 and age <= KEPT_SECONDS)
