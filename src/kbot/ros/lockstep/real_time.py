"""Paces a simulation to real time, for programs that do not wait for it."""

from __future__ import annotations

import time

from kbot.sim import Simulation
from kbot.sim.real_time import BEHIND, PERIOD


class RealTime:
    """Between two slices, it answers the service calls of programs."""

    def __init__(self, simulation: Simulation) -> None:
        self._simulation = simulation
        self._slice = max(1, round(PERIOD / simulation.timestep))
        self._left = self._slice
        self._due = time.monotonic() + PERIOD

    def wait(self, steps: int) -> int:
        """Wait until the next slice is due. Returns how many of the steps may be made now."""
        if self._left == 0:
            while (ahead := self._due - time.monotonic()) > 0.0:
                time.sleep(ahead)
            self._simulation.run_errands()
            self._due = max(self._due + PERIOD, time.monotonic() - BEHIND)
            self._left = self._slice
        allowed = min(steps, self._left)
        self._left -= allowed
        return allowed
