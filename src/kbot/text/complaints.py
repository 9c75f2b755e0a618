"""Limits the log of a server: bad requests of clients, and internal errors that the server survives."""

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
"""Complaints that are logged individually: enough to see the problem, too few to hide other output."""
EVERY_SECONDS = 60.0


class Complaints:
    """Logs the first warnings individually, and later ones as a count once a minute.

    The log stays short even if a client causes any number of warnings. If a request, message or task fails,
    the server continues, and passes the error to `fault`.
    """

    def __init__(self, log: logging.Logger, clock: Callable[[], float] = time.monotonic) -> None:
        self._log = log
        self._clock = clock
        self._logged = 0
        self._held_back = 0
        self._since = 0.0
        self._failed: set[str] = set()

    def add(self, text: str) -> None:
        """Log a complaint, or count it."""
        if self._logged < FIRST:
            self._logged += 1
            self._since = self._clock()
            self._log.warning("%s", text)
            return
        self._held_back += 1
        if self._clock() - self._since >= EVERY_SECONDS:
            self._log.warning("%d more bad messages or requests. The last one: %s", self._held_back, text)
            self._held_back = 0
            self._since = self._clock()

    def fault(self, during: str, error: BaseException) -> str:
        """Log an internal error, and return the text for clients.

        The first error in each `during` gets a crash file.
        """
        reported = f"{type(error).__name__}: {error}"
        if during in self._failed:
            self.add(f"{during} failed again: {reported}")
        else:
            self._failed.add(during)
            self._log.error("%s", internal_error(error, during))
        return f"KBot could not process this: {reported}; please report it"

    # Any: the signature that asyncio defines
    def loop_fault(self, loop: asyncio.AbstractEventLoop, context: dict[str, Any]) -> None:
        """Handle errors that no task or callback of the server caught, for `loop.set_exception_handler`."""
        error = context.get("exception")
        if error is None or isinstance(error, OSError):  # OSError: a broken connection
            self.add(f"{context['message']}: {error}" if error else context["message"])
        else:
            self.fault("a task of the server", error)
