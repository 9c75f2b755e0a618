"""Shows what KBot is doing, if that takes longer than a second."""

from __future__ import annotations

import gc
import os
import sys
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from datetime import timedelta
from itertools import cycle
from time import monotonic, process_time
from typing import TextIO

from kbot.cli.output import print_note
from kbot.text.progress import progress_sent_to
from kbot.text.terminal import for_progress

PATIENCE = 1.0
"""Seconds after which the terminal shows that KBot is busy. Shorter waits need no display."""
LINE_SECONDS = 60.0
"""Seconds between two lines in a file or a pipe, as in the log of a CI."""
SLOW = 10.0
"""Seconds of processor time after which a file or a pipe gets a line about what takes so long. Wall-clock
time would depend on how busy the machine is."""
REFRESH = 0.1
"""Seconds between two updates of the progress line."""
_CLOSED = (OSError, ValueError)
"""Errors of writing to a terminal or pipe that was closed. The progress then stops, and KBot continues."""
_BAR = 30
"""Characters of the bar."""
_COLUMNS = 80
"""Width of a terminal that does not report its own."""


class _LastLine:
    """A terminal whose last line shows the progress. What is written to it appears above this line."""

    def __init__(self, terminal: TextIO) -> None:
        self.terminal = terminal
        self._lock = threading.Lock()
        self._unfinished = ""

    def __getattr__(self, name: str) -> object:
        """Everything else is the terminal's."""
        return getattr(self.terminal, name)

    def write(self, text: str) -> int:
        with self._lock:
            lines, end, self._unfinished = (self._unfinished + text).rpartition("\n")
            if end:
                self._show("")
                self.terminal.write(lines + end)
                self.terminal.flush()
        return len(text)

    def show(self, text: str) -> None:
        with self._lock:
            self._show(text)

    def close(self) -> None:
        """Clear the line. Then write what does not end with a line break."""
        self.show("")
        self.terminal.write(self._unfinished)

    def _show(self, text: str) -> None:
        try:
            columns = os.get_terminal_size(self.terminal.fileno()).columns or _COLUMNS
        except (OSError, ValueError):
            columns = _COLUMNS
        line = for_progress(self.terminal)
        line.write("\r\x1b[2K" + text[: columns - 1])  # a longer line would wrap, and not be cleared
        line.flush()


@contextmanager
def _shown(text: Callable[[], str]) -> Iterator[None]:
    """Show a text in the last line of the terminal within the block, if the block takes a while."""
    done = threading.Event()

    def show() -> None:
        if done.wait(PATIENCE):
            return
        terminal = sys.stderr
        line = _LastLine(terminal)
        sys.stderr = line  # it is a TextIO by __getattr__
        with suppress(*_CLOSED):
            try:
                for mark in cycle("-\\|/"):
                    line.show(f"{mark} {text()}")
                    if done.wait(REFRESH):
                        return
            finally:
                sys.stderr = terminal
                line.close()

    thread = threading.Thread(target=show, daemon=True)
    thread.start()
    try:
        yield
    finally:
        done.set()
        thread.join()


def _is_terminal() -> bool:
    """Whether stderr is a terminal that can clear a line."""
    return sys.stderr.isatty() and os.environ.get("TERM") != "dumb"


@contextmanager
def busy(what: str) -> Iterator[Callable[[str], None]]:
    """Show `what` on stderr within the block, if the block takes a while.

    The yielded function replaces the text. Do not print to stdout in the block: the text would begin behind
    the progress. Without a terminal, lines on stderr show the text.
    """
    if not _is_terminal():
        with _printed_if_slow(what) as print_instead:
            yield print_instead
        return

    def replace(text: str) -> None:
        nonlocal what
        what = text

    with _shown(lambda: what):
        yield replace


@contextmanager
def _printed_if_slow(what: str) -> Iterator[Callable[[str], None]]:
    """Print the text that the yielded function sets, if the block is slow."""
    is_done, begun = threading.Event(), process_time()

    def replace(text: str) -> None:
        nonlocal what
        what = text

    def watch() -> None:
        pause = SLOW
        with suppress(*_CLOSED):
            while not is_done.wait(pause):
                if process_time() - begun >= SLOW:
                    print_note(f"{what} …")
                    pause = LINE_SECONDS

    watching = threading.Thread(target=watch, daemon=True)
    watching.start()
    try:
        yield replace
    finally:
        is_done.set()
        watching.join()


class _TimeLeft:
    """The time left for parts of a whole, if each takes as long as the mean of those that are done.

    An estimate from the last seconds alone is unreliable: a long part makes no progress in them, or several
    parts end at once.
    """

    def __init__(self, total: int, now: float) -> None:
        self.total, self.done = total, 0
        self._begun = self._last = now

    def advance(self, now: float) -> None:
        self.done += 1
        self._last = now

    def seconds(self, now: float) -> float | None:
        """None before the first part is done."""
        if not self.done:
            return None
        left = (self._last - self._begun) / self.done * (self.total - self.done)
        return max(0.0, left - (now - self._last))


@contextmanager
def counting(what: str, total: int) -> Iterator[Callable[[], None]]:
    """Show how many of `total` parts are done, and the time left, if the block takes a while.

    The yielded function reports that one more part is done. Without a terminal, lines on stderr show it.
    """
    left = _TimeLeft(total, monotonic())
    if not _is_terminal() or not total:
        yield _lines(what, left)
        return

    def text() -> str:
        bar = "#" * (_BAR * left.done // total)
        return f"{what} [{bar:-<{_BAR}}] {left.done}/{total} {_duration(left.seconds(monotonic()))}"

    with _shown(text):
        yield lambda: left.advance(monotonic())


def _lines(what: str, left: _TimeLeft) -> Callable[[], None]:
    """A function that counts a part, and prints a line if the last one is a while ago."""
    printed = monotonic()

    def advance() -> None:
        nonlocal printed
        now = monotonic()
        left.advance(now)
        if now - printed >= LINE_SECONDS and left.done < left.total:
            printed = now
            print_note(f"{what}: {left.done} of {left.total} done, about {_duration(left.seconds(now))} left")

    return advance


def _duration(seconds: float | None) -> str:
    """Hours, minutes and seconds."""
    return "-:--:--" if seconds is None else str(timedelta(seconds=round(seconds)))


@contextmanager
def loading(what: str) -> Iterator[None]:
    """Show that `what` is being loaded and by which step, as `busy` does, and collect no garbage within the
    block.

    The loaded objects live until the program ends. Searching them for cycles takes a tenth of the time.
    """
    collecting = gc.isenabled()
    gc.disable()
    try:
        with (
            busy(f"loading {what}") as replace,
            progress_sent_to(lambda step: replace(f"loading {what}: {step}")),
        ):
            yield
    finally:
        gc.freeze()
        if collecting:
            gc.enable()
