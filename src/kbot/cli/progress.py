"""Shows on a terminal what is being loaded when it takes longer than a second."""

from __future__ import annotations

import gc
import sys
import threading
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager

PATIENCE = 1.0
"""Seconds after which a person wants to know that something goes on."""


@contextmanager
def busy(what: str) -> Iterator[None]:
    """Say on stderr what is being done once it has lasted a while, until it ends; only on a terminal."""
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
    """As `busy`, for what stays until the end: a tenth of the time would go into looking for cycles in it."""
    collecting = gc.isenabled()
    gc.disable()
    try:
        with busy(f"loading {what}"):
            yield
    finally:
        gc.freeze()
        if collecting:
            gc.enable()
