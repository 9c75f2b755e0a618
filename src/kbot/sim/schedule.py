"""Faults in time: each begins at a step and ends at another, also when a run is reset or restored."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING

from kbot.sim.faults import End, Fault

if TYPE_CHECKING:
    from kbot.sim.disturbed import Disturbed

FOREVER = 1 << 62


@dataclass
class _Entry:
    fault: Fault
    start: int
    stop: int
    done: bool = False
    end: End | None = None


@dataclass
class Schedule:
    """The faults of one simulation."""

    entries: list[_Entry] = field(default_factory=list)

    def add(self, fault: Fault, start: int, stop: int) -> None:
        self.entries.append(_Entry(fault, start, stop))

    def next_step(self, step: int) -> int:
        """The next step after this one at which something begins or ends."""
        times = [time for e in self.entries for time in (e.start, e.stop) if time > step]
        return min(times, default=FOREVER)

    def bring_to(self, simulation: Disturbed, step: int) -> None:
        """End what is over at this step, begin what is due."""
        for entry in self.entries:
            if entry.end is not None and not entry.start <= step < entry.stop:
                entry.end()
                entry.end = None
        for entry in self.entries:
            if not entry.done and entry.start <= step < entry.stop:
                entry.done = True
                entry.end = entry.fault.begin(simulation)

    def jump_to(self, simulation: Disturbed, step: int) -> None:
        """After a jump in time: what acts at that step acts."""
        for entry in self.entries:
            if entry.end is not None:
                entry.end()
                entry.end = None
            entry.done = False
        self.bring_to(simulation, step)

    def begin_again(self, simulation: Disturbed) -> None:
        """After the engine's model was built anew: what lasts acts in the new one too."""
        for entry in self.entries:
            if entry.end is not None:
                entry.end = entry.fault.begin(simulation)
