"""Publishes what the user's program prints on the topic `/log`, with the simulated time."""

from __future__ import annotations

import io
import threading
from typing import TextIO

from kbot.brief import Brief
from kbot.messages.bus import Bus, Publisher
from kbot.messages.clock import Clock
from kbot.messages.log import INFO, Log
from kbot.messages.program_topics import PRINTED
from kbot.text.terminal import TerminalStream

LONGEST = 2000
"""Characters of a published line. The terminal shows the whole line."""


class PrintedLines(Brief):
    """The lines of the user's program. The page shows them in its log, and recordings contain them."""

    def __init__(self, bus: Bus, clock: Clock) -> None:
        self._bus, self._clock = bus, clock
        self._publisher: Publisher[Log] | None = None

    def add(self, text: str, level: int = INFO, file: str = "", line: int = 0) -> None:
        """Publish a line. `file` and `line` are the place in the program that it is about, if any."""
        if self._publisher is None:
            self._publisher = self._bus.advertise(PRINTED, Log, latched=True)
            self._bus.announce()
        short = text if len(text) <= LONGEST else f"{text[: LONGEST - 1]}…"
        self._publisher.publish(Log(self._clock.stamp, level, "program", short, file, "", line))


class PrintStream(io.TextIOBase):
    """A standard output that also publishes each complete line."""

    def __init__(self, stream: TextIO, lines: PrintedLines) -> None:
        """Text is written to `stream` as well, exactly: the program may control the terminal."""
        self.stream = stream.unfiltered if isinstance(stream, TerminalStream) else stream
        self._lines = lines
        self._begun = ""
        self._publishes = False
        self._owner = threading.get_ident()

    @property
    def encoding(self) -> str:  # type: ignore[override]  # a property here, an attribute in the base class
        return self.stream.encoding

    def __getattr__(self, name: str) -> object:
        """Other attributes are the stream's, for example the cell of a notebook's stream."""
        return getattr(self.stream, name)

    def writable(self) -> bool:
        return True

    def isatty(self) -> bool:
        return self.stream.isatty()

    def fileno(self) -> int:
        return self.stream.fileno()

    def flush(self) -> None:
        self.stream.flush()

    def write(self, text: str) -> int:
        count = self.stream.write(text)
        if threading.get_ident() != self._owner or self._publishes:
            return count  # only the thread of the simulation may publish, and what a subscriber prints is not
        *complete, self._begun = (self._begun + text).split("\n")
        self._publishes = True
        try:
            for line in complete:
                self._lines.add(line)
        finally:
            self._publishes = False
        self._begun = self._begun[-LONGEST:]  # a program may print without an end of line
        return count

    def end(self) -> None:
        """Publish a last line without an end of line."""
        if self._begun:
            self._lines.add(self._begun)
            self._begun = ""
