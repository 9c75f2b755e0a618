"""Reports a program of a headless run that computes for long and makes no step."""

from __future__ import annotations

import sys
import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from kbot.sim import Simulation
    from kbot.sim.user_code import UserCode

PATIENCE_SECONDS = 5.0
"""Seconds without a step after which the program is reported."""
LOOK_SECONDS = 0.2
"""Seconds between two looks at the simulation."""


@contextmanager
def still_time_reported(simulation: Simulation, code: UserCode) -> Iterator[None]:
    """Print one line to stderr, once, if the program that runs on this thread makes no step for long."""
    thread, has_ended = threading.get_ident(), threading.Event()

    def watch() -> None:
        steps, since = simulation.steps, time.monotonic()
        while not has_ended.wait(LOOK_SECONDS):
            now = time.monotonic()
            if simulation.steps != steps:
                steps, since = simulation.steps, now
            elif now - since >= PATIENCE_SECONDS:
                sys.stderr.write(f"{code.stands_still(thread, now - since, simulation.stepping.emptied)}\n")
                sys.stderr.flush()
                return

    threading.Thread(target=watch, daemon=True, name="kbot-still-time").start()
    try:
        yield
    finally:
        has_ended.set()
