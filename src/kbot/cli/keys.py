"""Reads single keys from the terminal."""

from __future__ import annotations

import os
import select
import sys
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager

_LOOK_SECONDS = 0.1
"""Longest wait for a key before the thread checks whether the block has ended."""


@contextmanager
def keys(pressed: Callable[[str], None]) -> Iterator[None]:
    """Call `pressed` with each key that is typed within the block, on a separate thread.

    The terminal's mode is restored afterwards. If stdin is not a terminal, nothing is read. Ctrl-C still ends
    the program.
    """
    if not sys.stdin.isatty():
        yield
        return
    closed = threading.Event()
    if sys.platform == "win32":
        thread = threading.Thread(target=_read_windows, args=(pressed, closed), daemon=True)
        thread.start()
        try:
            yield
        finally:
            closed.set()
        return
    import termios  # not available on Windows
    import tty

    descriptor = sys.stdin.fileno()
    before = termios.tcgetattr(descriptor)
    thread = threading.Thread(target=_read, args=(descriptor, pressed, closed), daemon=True)
    try:
        tty.setcbreak(descriptor)
        thread.start()
        yield
    finally:
        closed.set()
        termios.tcsetattr(descriptor, termios.TCSADRAIN, before)


def _read(descriptor: int, pressed: Callable[[str], None], closed: threading.Event) -> None:
    while not closed.is_set():
        ready, _, _ = select.select([descriptor], [], [], _LOOK_SECONDS)
        if ready:
            data = os.read(descriptor, 64)
            if not data:
                return
            for key in data.decode("utf-8", "replace"):
                pressed(key)


def _read_windows(pressed: Callable[[str], None], closed: threading.Event) -> None:
    import msvcrt  # only available on Windows

    while not closed.wait(_LOOK_SECONDS / 5):
        while msvcrt.kbhit():  # type: ignore[attr-defined,unused-ignore]  # Windows only
            pressed(msvcrt.getwch())  # type: ignore[attr-defined,unused-ignore]  # Windows only
