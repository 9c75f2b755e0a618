"""Runs a simulation in real time, for connected peers."""

from __future__ import annotations

import time
from contextlib import suppress

from kbot.sim import Simulation

PERIOD = 0.02
"""Seconds that are simulated at once: one control period."""
BEHIND = 0.2
"""Most seconds of wall-clock time to catch up. On a machine that is too slow, the simulation falls behind."""


def run_in_real_time(simulation: Simulation, seconds: float | None) -> None:
    """Run for a number of simulated seconds, or with None without an end. Ctrl-C ends the run early.

    Raises:
        SimulationDiverged: the simulation diverged.
    """
    with suppress(KeyboardInterrupt):
        _run(simulation, seconds)


def _run(simulation: Simulation, seconds: float | None) -> None:
    steps = max(1, round(PERIOD / simulation.timestep))
    period = steps * simulation.timestep
    left = None if seconds is None else simulation.stepping.steps_in(seconds)
    due = time.monotonic()
    while left is None or left > 0:
        simulation.run_errands()
        if not simulation.paused:
            count = steps if left is None else min(steps, left)
            simulation.step(count)
            left = None if left is None else left - count
        due = max(due + period, time.monotonic() - BEHIND)
        wait = due - time.monotonic()
        if wait > 0.0:
            time.sleep(wait)
