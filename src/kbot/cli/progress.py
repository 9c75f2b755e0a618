"""Shows on a terminal what KBot is doing, if that takes longer than a second."""

from __future__ import annotations

import gc
import sys
import threading
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from rich.status import Status

PATIENCE = 1.0
"""Seconds after which the terminal shows that KBot is busy. Shorter waits need no display."""


@contextmanager
def busy(what: str) -> Iterator[Callable[[str], None]]:
    """Show `what` on stderr within the block, if stderr is a terminal and the block takes a while.

    The yielded function replaces the text. Do not print to stdout in the block: it would go to stderr.
    """
    if not sys.stderr.isatty():
        yield lambda _: None
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
def counting(what: str, total: int) -> Iterator[Callable[[], None]]:
    """Show how many of `total` parts are done, and the time left, if the block takes a while.

    The yielded function reports that one more part is done.
    """
    if not sys.stderr.isatty() or not total:
        yield lambda: None
        return
    from rich.console import Console  # slow to import; only on a terminal
    from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeRemainingColumn

    from kbot.text.terminal import for_progress

    columns = TextColumn(what), BarColumn(), MofNCompleteColumn(), TimeRemainingColumn()
    progress = Progress(*columns, console=Console(file=for_progress(sys.stderr)), transient=True)
    bar = progress.add_task(what, total=total)
    waiting = threading.Timer(PATIENCE, progress.start)
    waiting.daemon = True
    waiting.start()
    try:
        yield lambda: progress.advance(bar)
    finally:
        waiting.cancel()
        waiting.join()
        progress.stop()


@contextmanager
def loading(what: str) -> Iterator[None]:
    """Show that `what` is being loaded, as `busy` does, and collect no garbage within the block.

    The loaded objects live until the program ends. Searching them for cycles takes a tenth of the time.
    """
    collecting = gc.isenabled()
    gc.disable()
    try:
        with busy(f"loading {what}"):
            yield
    finally:
        gc.freeze()
        if collecting:
            gc.enable()
