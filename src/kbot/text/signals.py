"""The signals that end KBot: Ctrl-C, `kill` and a closed terminal."""

from __future__ import annotations

import os
import signal
import sys
import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager

INTERRUPTED = 130
"""Exit status after Ctrl-C, as in a shell: 128 + SIGINT."""
AGAIN_SECONDS = 0.05
"""Seconds after which a discarded interruption is raised again. Destructors and callbacks take less."""
REPEAT_SECONDS = 1.0
"""Seconds in which a repeated signal counts once. `timeout` sends it to the process and to its group."""


class Ending:
    """The signal that interrupted a block, or 0, and when."""

    number = 0
    at = 0.0


@contextmanager
def interrupted_by_all() -> Iterator[Ending]:
    """Let SIGTERM and SIGHUP end the block as Ctrl-C does, with KeyboardInterrupt: what is finished is
    reported, and temporary folders are removed."""
    ending = Ending()

    def interrupt(number: int, frame: object) -> None:
        now = time.monotonic()
        if ending.number and now - ending.at < REPEAT_SECONDS:
            return
        ending.number, ending.at = number, now
        raise KeyboardInterrupt

    if threading.current_thread() is not threading.main_thread():
        yield ending
        return
    others = [number for number in ending_signals() if number != signal.SIGINT]
    before = {number: signal.signal(number, interrupt) for number in others}
    try:
        yield ending
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)


def ending_signals() -> list[signal.Signals]:
    """SIGINT, SIGTERM and SIGHUP, which Windows lacks.

    Those that the caller has set to be ignored are left out: `nohup` ignores SIGHUP, and a shell script
    ignores SIGINT for `kbot … &`.
    """
    known = [getattr(signal, name) for name in ("SIGINT", "SIGTERM", "SIGHUP") if hasattr(signal, name)]
    return [number for number in known if signal.getsignal(number) != signal.SIG_IGN]


def signal_main_thread(number: int = signal.SIGINT) -> None:
    """Send a signal to the main thread, so that it also wakes up from a sleep."""
    if os.name == "nt":
        signal.raise_signal(number)  # Windows wakes up the main thread from any thread
    else:
        signal.pthread_kill(threading.main_thread().ident or 0, number)


def raise_discarded_interruptions() -> None:
    """Raise Ctrl-C again if Python discards it.

    Python discards errors in destructors and in callbacks of its importer. While KBot starts, about one
    Ctrl-C in 200 raises its error there.
    """
    report = sys.unraisablehook

    def raise_again(discarded: sys.UnraisableHookArgs) -> None:
        # a handler raises SystemExit for SIGTERM and SIGHUP
        if not issubclass(discarded.exc_type, KeyboardInterrupt | SystemExit):
            report(discarded)
            return
        is_ctrl_c = issubclass(discarded.exc_type, KeyboardInterrupt)
        number = signal.SIGINT if is_ctrl_c else signal.SIGTERM
        timer = threading.Timer(AGAIN_SECONDS, signal_main_thread, [number])
        timer.daemon = True
        timer.start()

    sys.unraisablehook = raise_again


@contextmanager
def uninterrupted() -> Iterator[None]:
    """Delay the signals that end KBot to the end of the block, where the system can.

    Only the main thread runs their handlers, so this matters only there.
    """
    if os.name == "nt":
        yield
        return
    before = signal.pthread_sigmask(signal.SIG_BLOCK, ending_signals())
    try:
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)
