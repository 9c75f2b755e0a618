"""How far a run without a page is: one line on a terminal, once it takes longer than a second."""

from __future__ import annotations

import sys
import time
from types import TracebackType

from kbot.cli.progress import PATIENCE
from kbot.sim import Simulation

INTERVAL = 0.2


class Progress:
    """Shows simulated time and speed on stderr while it is entered; `wall` is how long that was."""

    def __init__(self, simulation: Simulation, seconds: float | None) -> None:
        """`seconds`: how long the run will be, None where that is not known."""
        self._simulation, self._seconds = simulation, seconds
        self.wall = 0.0
        self._shown = False

    def __enter__(self) -> Progress:
        self._begin = self._last = time.perf_counter()
        self._before = self._simulation.time
        self._timer = None
        if sys.stderr.isatty():
            self._timer = self._simulation.clock.every(10.0, self._look)
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.wall = time.perf_counter() - self._begin
        if self._timer is not None:
            self._timer.cancel()
        if self._shown:
            sys.stderr.write("\r\x1b[K")

    def _look(self) -> None:
        now = time.perf_counter()
        if now - self._begin < PATIENCE or now - self._last < INTERVAL:
            return
        self._last, self._shown = now, True
        done = self._simulation.time - self._before
        rate = done / (now - self._begin)
        share = f" {100 * done / self._seconds:3.0f} %" if self._seconds else ""
        sys.stderr.write(f"\r\x1b[K{done:10.1f} s simulated{share}   {rate:.0f} times real time")
        sys.stderr.flush()
