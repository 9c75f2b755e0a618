"""Stops a program that takes too much processor time, and names the line that runs."""

from __future__ import annotations

import ctypes
import sys
import threading
import time
from collections.abc import Iterator, Sequence
from contextlib import contextmanager

from kbot.sim.user_code import UserCode, shown_path
from kbot.text import KbotError
from kbot.text.errors import Stopped

PERIOD = 0.1
"""Seconds between two looks."""


@contextmanager
def watchdog(programs: Sequence[UserCode], seconds: float) -> Iterator[None]:
    """Stop the user's programs in this block if it takes `seconds` of processor time.

    A program is stopped only in its own code, never in KBot's.

    Raises:
        KbotError: a program was stopped.
    """
    thread, begun, over = threading.get_ident(), time.process_time(), threading.Event()
    place = ""

    def watch() -> None:
        nonlocal place
        while not over.wait(PERIOD):
            if time.process_time() - begun < seconds:
                continue
            frame = sys._current_frames().get(thread)
            if frame is not None and any(each.has(frame.f_code.co_filename) for each in programs):
                place = f"{shown_path(frame.f_code.co_filename)}:{frame.f_lineno}"
                ctypes.pythonapi.PyThreadState_SetAsyncExc(ctypes.c_ulong(thread), ctypes.py_object(Stopped))

    watcher = threading.Thread(target=watch, daemon=True, name="kbot-watchdog")
    if programs:
        watcher.start()
    try:
        yield
    except Stopped:
        raise KbotError(f"{place}: the trial took longer than {seconds:g} s and was stopped here") from None
    finally:
        over.set()
