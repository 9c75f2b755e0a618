"""Decides which thread may use the simulation: that of the user's program, or those of the server."""

from __future__ import annotations

import asyncio
import threading
import time
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager

from kbot.text.signals import uninterrupted

WAITING_SECONDS = 0.02
"""Seconds for which a program that waits lends the simulation, before it looks whether to continue."""
POLL_SECONDS = 0.002
"""Seconds between two attempts of the server to get the simulation. It gets it between two slices."""
LEAST_SECONDS = 0.005
"""Seconds for which a program lends the simulation: the server looks at least once in that time."""
GREETING_SECONDS = 0.5
"""Seconds that a new page waits for the current state while a program uses the simulation."""


class Turns:
    """One user at a time. Without a program, the server always gets the simulation at once."""

    def __init__(self) -> None:
        self._lock = threading.Lock()
        self._is_programs = False
        """Whether the program has the simulation. Ctrl-C can keep it from taking it back."""

    async def __aenter__(self) -> None:
        """Wait, on the server's loop, until the program lends the simulation."""
        while not self.try_take():
            await asyncio.sleep(POLL_SECONDS)

    async def __aexit__(self, *_: object) -> None:
        self.give_back()

    @asynccontextmanager
    async def within(self, seconds: float) -> AsyncIterator[bool]:
        """Take the simulation, on the server's loop, if a program lends it in that time. Yields whether."""
        end = time.monotonic() + seconds
        while not (is_taken := self.try_take()) and time.monotonic() < end:
            await asyncio.sleep(POLL_SECONDS)
        try:
            yield is_taken
        finally:
            if is_taken:
                self.give_back()

    def try_take(self) -> bool:
        """Take the simulation, on the server's loop, if nobody uses it."""
        return self._lock.acquire(blocking=False)

    def give_back(self) -> None:
        """End the server's turn."""
        self._lock.release()

    def take(self) -> None:
        """Wait for the simulation, on the program's thread."""
        with uninterrupted():
            self._lock.acquire()
            self._is_programs = True

    def leave(self) -> None:
        """Leave the simulation to the server, on the program's thread."""
        with uninterrupted():
            if self._is_programs:
                self._is_programs = False
                self._lock.release()

    def lend(self, seconds: float) -> None:
        """Give the server the simulation for some time, on the program's thread."""
        self.leave()
        try:
            time.sleep(max(seconds, LEAST_SECONDS))
        finally:
            self.take()
