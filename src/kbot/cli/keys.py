"""Reads single keys from the terminal."""

from __future__ import annotations

import os
import select
import sys
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager

_LOOK_SECONDS = 0.1


@contextmanager
def keys(pressed: Callable[[str], None]) -> Iterator[None]:
    """Within it, each key of the terminal is handed on, on a thread of its own; the terminal is as it was
    afterwards. Nothing happens where the input is no terminal. Ctrl-C goes on to end the program."""
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
    import termios  # Windows has none
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
    import msvcrt  # only Windows has it

    while not closed.wait(_LOOK_SECONDS / 5):
        while msvcrt.kbhit():  # type: ignore[attr-defined,unused-ignore]  # of Windows alone
            pressed(msvcrt.getwch())  # type: ignore[attr-defined,unused-ignore]  # of Windows alone
