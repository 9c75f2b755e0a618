"""Faults in time: each begins at a step and ends at another, also when a run is reset or restored."""

from __future__ import annotations

from dataclasses import dataclass, field

from kbot.sim.faults import End, Fault
from kbot.sim.population import Population
from kbot.sim.running import FOREVER


@dataclass(frozen=True, slots=True)
class Placed:
    """A fault by its number, and from when to when it acts: seconds of simulated time, inf for good."""

    number: int
    fault: Fault
    start: float
    stop: float


@dataclass(eq=False)
class _Entry:
    number: int
    fault: Fault
    start: int
    stop: int
    done: bool = False
    end: End | None = None


@dataclass
class Schedule:
    """The faults of one simulation, by number in the order they were placed."""

    entries: list[_Entry] = field(default_factory=list)
    placed: int = 0
    acting: list[_Entry] = field(default_factory=list)
    """Those that have something to end, in the order they began."""

    def add(self, fault: Fault, start: int, stop: int) -> int:
        self.placed += 1
        self.entries.append(_Entry(self.placed, fault, start, stop))
        return self.placed

    def take_out(self, simulation: Population, number: int) -> bool:
        """End a fault, and let it not come again; whether there is one of that number."""
        entry = next((one for one in self.entries if one.number == number), None)
        if entry is None:
            return False
        self._end(simulation, [entry])
        self.entries.remove(entry)
        return True

    def forget(self, simulation: Population, robot: str) -> None:
        """Take out the faults of a robot that goes."""
        gone = [entry for entry in self.entries if getattr(entry.fault, "robot", None) == robot]
        self._end(simulation, gone)
        self.entries = [entry for entry in self.entries if entry not in gone]

    def next_step(self, step: int) -> int:
        """The next step after this one at which something begins or ends."""
        times = [time for e in self.entries for time in (e.start, e.stop) if time > step]
        return min(times, default=FOREVER)

    def bring_to(self, simulation: Population, step: int) -> None:
        """End what is over at this step, begin what is due."""
        self._end(simulation, [entry for entry in self.acting if not entry.start <= step < entry.stop])
        for entry in self.entries:
            if not entry.done and entry.start <= step < entry.stop:
                entry.done = True
                self._begin(simulation, entry)

    def jump_to(self, simulation: Population, step: int) -> None:
        """After a jump in time: what acts at that step acts."""
        self._end(simulation, list(self.acting))
        for entry in self.entries:
            entry.done = False
        self.bring_to(simulation, step)

    def begin_again(self, simulation: Population) -> None:
        """After the engine's model was built anew: what lasts acts in the new one too."""
        lasting, self.acting = self.acting, []
        for entry in lasting:
            self._begin(simulation, entry)

    def _begin(self, simulation: Population, entry: _Entry) -> None:
        entry.end = entry.fault.begin(simulation)
        if entry.end is not None:
            self.acting.append(entry)

    def _end(self, simulation: Population, over: list[_Entry]) -> None:
        """End some. Each puts back what it found: those that began later end first, and begin again."""
        first = min((self.acting.index(entry) for entry in over if entry in self.acting), default=None)
        if first is None:
            return
        later, self.acting = self.acting[first:], self.acting[:first]
        for entry in reversed(later):
            if entry.end is not None:
                entry.end()
                entry.end = None
        for entry in later:
            if entry not in over:
                self._begin(simulation, entry)
