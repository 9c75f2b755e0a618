"""Shows what KBot is doing, if that takes longer than a second."""

from __future__ import annotations

import gc
import sys
import threading
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager
from datetime import timedelta
from time import monotonic, process_time
from typing import TYPE_CHECKING

from kbot.cli.output import print_note
from kbot.text.progress import progress_sent_to

if TYPE_CHECKING:
    from rich.status import Status

PATIENCE = 1.0
"""Seconds after which the terminal shows that KBot is busy. Shorter waits need no display."""
LINE_SECONDS = 60.0
"""Seconds between two lines in a file or a pipe, as in the log of a CI."""
SLOW = 10.0
"""Seconds of processor time after which a file or a pipe gets a line about what takes so long. Wall-clock
time would depend on how busy the machine is."""


@contextmanager
def busy(what: str) -> Iterator[Callable[[str], None]]:
    """Show `what` on stderr within the block, if the block takes a while.

    The yielded function replaces the text. Do not print to stdout in the block: on a terminal it would go to
    stderr. Without a terminal, lines on stderr show the text.
    """
    if not sys.stderr.isatty():
        with _printed_if_slow(what) as replace:
            yield replace
        return
    status: Status | None = None
    with ExitStack() as shown:

        def show() -> None:
            nonlocal status
            from rich.console import Console  # slow to import; only on a terminal
            from rich.text import Text  # a file name may look like markup

            from kbot.text.terminal import for_progress

            status = shown.enter_context(Console(file=for_progress(sys.stderr)).status(Text(what)))

        def replace(text: str) -> None:
            nonlocal what
            what = text
            if status is not None:
                from rich.text import Text

                status.update(Text(text))

        waiting = threading.Timer(PATIENCE, show)
        waiting.daemon = True
        waiting.start()
        try:
            yield replace
        finally:
            waiting.cancel()
            waiting.join()


@contextmanager
def _printed_if_slow(what: str) -> Iterator[Callable[[str], None]]:
    """Print the text that the yielded function sets, if the block is slow."""
    is_done, begun = threading.Event(), process_time()

    def replace(text: str) -> None:
        nonlocal what
        what = text

    def watch() -> None:
        pause = SLOW
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

    Rich estimates from the last seconds only, in which a long part shows nothing, or several end at once.
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
    if not sys.stderr.isatty() or not total:
        yield _lines(what, left)
        return
    from rich.console import Console  # slow to import; only on a terminal
    from rich.progress import BarColumn, MofNCompleteColumn, Progress, ProgressColumn, Task, TextColumn
    from rich.text import Text

    from kbot.text.terminal import for_progress

    class TimeColumn(ProgressColumn):
        def render(self, task: Task) -> Text:
            return Text(_duration(left.seconds(monotonic())))

    columns = TextColumn(what), BarColumn(), MofNCompleteColumn(), TimeColumn()
    progress = Progress(*columns, console=Console(file=for_progress(sys.stderr)), transient=True)
    bar = progress.add_task(what, total=total)

    def advance() -> None:
        left.advance(monotonic())
        progress.advance(bar)

    waiting = threading.Timer(PATIENCE, progress.start)
    waiting.daemon = True
    waiting.start()
    try:
        yield advance
    finally:
        waiting.cancel()
        waiting.join()
        progress.stop()


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
