"""Saved states of a simulation over time, in bounded memory, for *Resume from here*."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

from kbot.text import KbotError
from kbot.workbench.timeline.history import KEPT_SECONDS

EVERY = 0.2
"""Seconds of the timeline between two states that are saved."""
ALL_FOR, THEN_EVERY = 60.0, 25
"""Seconds for which all are kept; of older ones every 25th is, one in 5 s."""
MOST_BYTES = 200_000_000


@dataclass(frozen=True, slots=True)
class Saved:
    """A state that was taken `at` seconds along the timeline, at a simulated time in s; `size` in bytes."""

    number: int
    lap: int
    """Another one each time that the simulation was set back."""
    at: float
    time: float
    state: object
    size: int


class SavedStates:
    """Those of one run; of the one before nothing can go on."""

    def __init__(self) -> None:
        self._all: list[Saved] = []
        self._count = 0
        self._run: object = None

    @property
    def size(self) -> int:
        """Bytes held, about."""
        return sum(saved.size for saved in self._all)

    def keep(
        self, at: float, time: float, run: object, take: Callable[[], tuple[object, int] | None]
    ) -> None:
        """Take a state where one is due; `take` gives it with its size, or nothing where there is none."""
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
        """The one to go on from instead of a moment. Raises KbotError: none is near."""
        known = self._all if run is self._run else []
        if not known:
            raise KbotError("no state is saved yet of this robot and world that could be gone on from")
        if at < known[0].at - EVERY:
            raise KbotError(
                "no state is saved there, for the robot or its world was another then: the first to go on "
                f"from comes {known[0].at - at:.1f} s later"
            )
        lap = max((saved.lap for saved in known if saved.at <= at), default=known[0].lap)
        return min((saved for saved in known if saved.lap == lap), key=lambda saved: abs(saved.at - at))


def _is_kept(saved: Saved, age: float) -> bool:
    return age <= ALL_FOR or (saved.number % THEN_EVERY == 0 and age <= KEPT_SECONDS)
