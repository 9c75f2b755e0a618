"""A log that stays short: errors of clients, and internal errors that a server survives."""

from __future__ import annotations

import logging
import time

from kbot.text.crash import internal_error

TYPE_CHECKING = False
if TYPE_CHECKING:
    import asyncio
    from collections.abc import Callable
    from typing import Any

FIRST = 5
"""Complaints that are logged one by one: enough to see what is wrong, too few to hide other output."""
EVERY_SECONDS = 60.0


class Complaints:
    """The first few warnings are logged one by one, later ones as a count once a minute: a client may cause
    any number.

    One request, message or task that fails does not end the server: its error goes to `fault`.
    """

    def __init__(self, log: logging.Logger, clock: Callable[[], float] = time.monotonic) -> None:
        self._log = log
        self._clock = clock
        self._logged = 0
        self._held_back = 0
        self._since = 0.0
        self._failed: set[str] = set()

    def add(self, text: str) -> None:
        """Log a complaint, or only count it."""
        if self._logged < FIRST:
            self._logged += 1
            self._since = self._clock()
            self._log.warning("%s", text)
            return
        self._held_back += 1
        if self._clock() - self._since >= EVERY_SECONDS:
            self._log.warning("%d more bad messages or requests; the last: %s", self._held_back, text)
            self._held_back = 0
            self._since = self._clock()

    def fault(self, during: str, error: BaseException) -> str:
        """Log an unforeseen error, with a crash file the first time it occurs in `during`. Returns the text
        for clients."""
        reported = f"{type(error).__name__}: {error}"
        if during in self._failed:
            self.add(f"{during} failed again: {reported}")
        else:
            self._failed.add(during)
            self._log.error("%s", internal_error(error, during))
        return f"KBot failed at this: {reported}; please report it"

    # Any: as asyncio defines it
    def loop_fault(self, loop: asyncio.AbstractEventLoop, context: dict[str, Any]) -> None:
        """For `loop.set_exception_handler`: an error that no task or callback of the server caught."""
        error = context.get("exception")
        if error is None or isinstance(error, OSError):  # OSError: a connection that broke
            self.add(f"{context['message']}: {error}" if error else context["message"])
        else:
            self.fault("a task of the server", error)
