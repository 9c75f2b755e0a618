"""Shows on a terminal what KBot is loading, if that takes longer than a second."""

from __future__ import annotations

import gc
import sys
import threading
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager

PATIENCE = 1.0
"""Seconds after which the terminal shows that KBot is busy. Shorter waits need no display."""


@contextmanager
def busy(what: str) -> Iterator[None]:
    """Show `what` on stderr within the block, if stderr is a terminal and the block takes a while."""
    if not sys.stderr.isatty():
        yield
        return
    with ExitStack() as shown:

        def show() -> None:
            from rich.console import Console  # slow to import; only on a terminal

            shown.enter_context(Console(stderr=True).status(what))

        waiting = threading.Timer(PATIENCE, show)
        waiting.daemon = True
        waiting.start()
        try:
            yield
        finally:
            waiting.cancel()
            waiting.join()


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
