"""What is logged about clients that misbehave: the first few lines, then now and then a count."""

from __future__ import annotations

import logging
import time
from collections.abc import Callable

FIRST = 5
EVERY_SECONDS = 60.0


class Complaints:
    """Warnings of which a client may cause any number."""

    def __init__(self, log: logging.Logger, clock: Callable[[], float] = time.monotonic) -> None:
        self._log = log
        self._clock = clock
        self._said = 0
        self._held_back = 0
        self._since = 0.0
        self._failed: set[str] = set()

    def add(self, text: str) -> None:
        """Log one of the first few; of later ones log how many came, once a minute."""
        if self._said < FIRST:
            self._said += 1
            self._since = self._clock()
            self._log.warning("%s", text)
            return
        self._held_back += 1
        if self._clock() - self._since >= EVERY_SECONDS:
            self._log.warning("%d more bad messages or requests; the last: %s", self._held_back, text)
            self._held_back = 0
            self._since = self._clock()

    def fault(self, during: str, error: Exception) -> str:
        """Log an error of KBot's own, its traceback only the first time that it comes `during` something;
        what to tell pages of it."""
        told = f"{type(error).__name__}: {error}"
        if during in self._failed:
            self.add(f"{during} failed again: {told}")
        else:
            self._failed.add(during)
            self._log.error("%s failed", during, exc_info=error)
        return f"KBot failed at this: {told}; please report it"
